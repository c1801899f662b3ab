// Selects the agents that choose a new action in a step, if agents hold each action for several steps
// (policy.decision_steps).
#pragma once

#include <ATen/ATen.h>

#include "pictura/simulator/controllers/controller.h"

namespace pictura {

/// Decision clock of one simulator. All agents decide at steps divisible by policy.decision_steps. An agent also
/// decides in its first step: after a reset of its world, at the start of a life, or if it was inactive at the previous
/// step. It holds this action until the next step divisible by policy.decision_steps.
class DecisionClock {
 public:
  explicit DecisionClock(int64_t decision_steps) : decision_steps_(decision_steps) {}

  /// Returns those of the `active` slots (i64 [n], in ascending order) that decide at the next step. Call it once per
  /// step. `step` is the number of the next step, which the caller counts. episode_over: u8 [worlds], or empty. In
  /// worlds with a nonzero entry, all agents decide, so that the policy computes the value of their last observation.
  /// Agents that have just left at the end of a road decide for the same reason. If the arrays are on a device, the
  /// host waits for it to learn the number of slots, unless all agents decide.
  at::Tensor select_deciding(const SimulatorArrays& input, const at::Tensor& active, int64_t step,
                             Span<const uint8_t> episode_over = {});

 private:
  const int64_t decision_steps_;
  at::Tensor acted_;  // u8 [slots] whether the agent was active at the previous step
};

}  // namespace pictura
