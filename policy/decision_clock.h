// Selection of the agents that choose a new action in a step.
#pragma once

#include <ATen/ATen.h>

#include "pictura/policy/rules/policy_executor.h"

namespace pictura {

/// Clock of one simulator. Agents decide at steps divisible by policy.decision_steps, and whenever they do not hold
/// their action (HeldActions).
class DecisionClock {
 public:
  explicit DecisionClock(int64_t decision_steps) : decision_steps_(decision_steps) {}

  /// Returns the `active` slots (i64 [n], ascending) that decide at `step`. Call it once before each step. With
  /// decides_at_end, all agents decide at the end of an episode, because learning needs their last value. On a device,
  /// waits unless all agents decide.
  at::Tensor select_deciding(const SimulatorArrays& input, const at::Tensor& active, int64_t step, bool decides_at_end,
                             PolicyExecutor* executor);

 private:
  const int64_t decision_steps_;
  at::Tensor acted_;  // u8 [slots], active at the previous step
};

}  // namespace pictura
