// Observers of a simulator's steps, such as recorders and live views.
#pragma once

#include "pictura/simulator/simulator.h"

namespace pictura {

/// All spans are in memory of the simulator's device.
class StepObserver {
 public:
  virtual ~StepObserver() = default;
  /// Whether the next step may be taken. The call may block for a short time.
  virtual bool is_due() { return true; }
  /// Replaces the commands [slots] of agents that the observer drives. Called in each step before any observer's
  /// before_step().
  virtual void override_commands(Span<Command> /*commands_inout*/) {}
  virtual void before_step(Span<const Command> /*commands*/) {}
  virtual void after_step(const StepResult& /*result*/) {}
  /// Called after a reset outside of a step. The mask [worlds] selects the reset worlds; an empty mask means all
  /// worlds.
  virtual void after_reset(Span<const uint8_t> /*world_mask*/) {}
};

/// Takes a step with commands [slots]. Calls before_step() of the observers in order, and after_step() in reverse
/// order.
template <typename Observers>
StepResult step_observed(Simulator& simulator, Span<Command> commands_inout, const Observers& observers,
                         Stream stream = {}) {
  for (const auto& observer : observers) observer->override_commands(commands_inout);
  for (const auto& observer : observers) observer->before_step(Span<const Command>(commands_inout));
  const StepResult result = simulator.step(Span<const Command>(commands_inout), stream);
  for (auto observer = observers.rbegin(); observer != observers.rend(); ++observer) (*observer)->after_step(result);
  return result;
}

}  // namespace pictura
