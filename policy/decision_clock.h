// Times at which agents decide if an action is held for several steps (policy.decision_steps).
#pragma once

#include <ATen/ATen.h>

#include "pictura/simulator/controllers/controller.h"

namespace pictura {

/// Decision clock of one simulator. All agents decide at steps divisible by policy.decision_steps. An agent that has
/// just begun (its world was reset, its life began, or the agent was inactive at the previous step) decides at once,
/// and holds that action until the next step divisible by policy.decision_steps.
class DecisionClock {
 public:
  explicit DecisionClock(int64_t decision_steps) : decision_steps_(decision_steps) {}

  /// Returns the subset of `active` (i64 [n], slots in ascending order) that decides at `step`, the next step. The
  /// caller numbers the steps. episode_over: u8 [worlds], or empty. All agents decide in worlds with a nonzero entry,
  /// so that the value of their last observation is known. For the same reason, agents that have just left a road that
  /// ends decide. On a device the call waits for a count, unless all agents decide.
  at::Tensor select_deciding(const SimulatorArrays& input, const at::Tensor& active, int64_t step,
                             Span<const uint8_t> episode_over = {});

 private:
  const int64_t decision_steps_;
  at::Tensor acted_;  // u8 [slots], at the previous step
};

}  // namespace pictura
