// When agents decide, where an action is held for several steps (policy.decision_steps).
#pragma once

#include <ATen/ATen.h>

#include "pictura/simulator/controllers/controller.h"

namespace pictura {

/// Clock of one simulator's decisions. All agents decide at steps divisible by policy.decision_steps. An agent that has
/// just begun (its world was reset, its life began, or the agent was inactive at the step before) decides at once, and
/// holds that action until the next such step.
class DecisionClock {
 public:
  explicit DecisionClock(int64_t decision_steps) : decision_steps_(decision_steps) {}

  /// The agents that decide at `step`, the next one: those of `active`, i64 [n] slots in ascending order, or some.
  /// Steps are numbered by the caller. episode_over: u8 [worlds], or empty: in worlds that it marks, all decide, so
  /// that the value of what they see last is known; likewise agents that have just left a road that ends. On a device
  /// waits for a count, unless all decide.
  at::Tensor deciding(const SimulatorArrays& input, const at::Tensor& active, int64_t step,
                      Span<const uint8_t> episode_over = {});

 private:
  const int64_t decision_steps_;
  at::Tensor acted_;  // u8 [slots] of the step before
};

}  // namespace pictura
