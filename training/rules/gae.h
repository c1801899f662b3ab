// Generalized advantage estimation (Schulman et al., 2016) with next-step autoreset: the recursion of one slot, from
// its last step to its first. Callers loop over slots and steps.
#pragma once

#include "pictura/common/span.h"

namespace pictura {

/// One transition. One that is
///   terminated  does not bootstrap;
///   truncated   bootstraps from the value of the next row, which is the final observation's: the world is reset by the
///               next call, whose transition is not valid; nothing flows back over the end of an episode;
///   not valid   (its agent had halted, or its world was being reset) gets 0 and ends what comes before it.
struct GaeTransition {
  float reward, value, next_value;
  bool is_terminated, is_truncated, is_valid;
};

/// The advantage of a transition, given that of the slot's next one (0 after the last).
PICTURA_HD inline float gae_advantage(const GaeTransition& transition, float next_advantage, float gamma,
                                      float gae_lambda) {
  const float bootstrap = transition.is_terminated ? 0.0f : transition.next_value;
  const float delta = transition.reward + gamma * bootstrap - transition.value;
  const bool goes_on = !transition.is_terminated && !transition.is_truncated;
  const float advantage = delta + gamma * gae_lambda * (goes_on ? next_advantage : 0.0f);
  return transition.is_valid ? advantage : 0.0f;
}

/// A rollout's transitions, [steps, slots] each, but for `values`, which has one step more.
struct TransitionArrays {
  Span<const float> rewards, values;
  Span<const uint8_t> terminated, truncated, valid;
  int64_t num_steps = 0, num_slots = 0;

  PICTURA_HD GaeTransition at(int64_t step, int64_t slot) const {
    const auto i = static_cast<size_t>(step * num_slots + slot);
    return {rewards[i],         values[i],         values[i + static_cast<size_t>(num_slots)],
            terminated[i] != 0, truncated[i] != 0, valid[i] != 0};
  }
};

}  // namespace pictura
