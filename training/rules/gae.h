// Generalized advantage estimation (Schulman et al., 2016) with next-step autoreset and actions held for several steps.
#pragma once

#include "pictura/common/span.h"

namespace pictura {

/// One step of one agent.
/// - A terminated step does not bootstrap.
/// - A truncated step bootstraps from the next row's value, that of the final observation. The next step is not valid,
///   so no advantage crosses the end of an episode.
/// - An invalid step (such as one of a halted agent) has the advantage 0. Earlier steps bootstrap from its value.
/// - A step without a decision continues the previous action. It has the advantage 0; its reward belongs to the last
///   decision.
struct GaeTransition {
  float reward, value, next_value;
  bool is_terminated, is_truncated, is_valid, is_decision;
};

/// Result of the recursion over later steps. value: discounted rewards up to the next decision, plus the value there.
/// advantage: that decision's discounted advantage.
struct GaeTail {
  float value = 0, advantage = 0;
};

/// Returns the advantage of a step's decision; 0 without a decision. Call it for a slot's steps from the last to the
/// first. Each step discounts by gamma, each decision by gae_lambda. So the return of an action held for k steps is the
/// sum of gamma^i r_i, bootstrapped with gamma^k. tail_inout: tail of the later steps; on return, it includes this
/// step.
PICTURA_HD inline float gae_advantage(const GaeTransition& transition, float gamma, float gae_lambda,
                                      GaeTail* tail_inout) {
  const bool goes_on = !transition.is_terminated && !transition.is_truncated;
  const float next_advantage = goes_on ? tail_inout->advantage : 0.0f;
  const float bootstrap =
      transition.is_terminated ? 0.0f : (transition.is_truncated ? transition.next_value : tail_inout->value);
  const float discounted = transition.reward + gamma * bootstrap;
  if (!transition.is_valid) {
    *tail_inout = {transition.value, 0.0f};
    return 0.0f;
  }
  if (!transition.is_decision) {
    *tail_inout = {discounted, gamma * next_advantage};
    return 0.0f;
  }
  const float advantage = discounted - transition.value + gamma * gae_lambda * next_advantage;
  *tail_inout = {transition.value, advantage};
  return advantage;
}

/// Arrays of a rollout, [steps, slots]; `values` has one more step.
struct TransitionArrays {
  Span<const float> rewards, values;
  Span<const uint8_t> terminated, truncated, valid;
  Span<const uint8_t> decides;  // empty: every step is a decision
  int64_t num_steps = 0, num_slots = 0;

  PICTURA_HD GaeTransition at(int64_t step, int64_t slot) const {
    const auto i = static_cast<size_t>(step * num_slots + slot);
    return {rewards[i],        values[i],     values[i + static_cast<size_t>(num_slots)], terminated[i] != 0,
            truncated[i] != 0, valid[i] != 0, decides.empty() || decides[i] != 0};
  }
  PICTURA_HD GaeTail tail(int64_t slot) const { return {values[num_steps * num_slots + slot], 0.0f}; }
};

}  // namespace pictura
