// Interface of observers that follow a simulator step by step (recorders, live views, probes), and the step that
// notifies observers.
#pragma once

#include "pictura/simulator/simulator.h"

namespace pictura {

/// An observer of a simulator's steps. All spans lie in the simulator's memory.
class StepObserver {
 public:
  virtual ~StepObserver() = default;
  /// Whether the next step may be taken; may wait a short time for it.
  virtual bool is_due() { return true; }
  /// Replaces the commands, [slots], of agents that the observer drives, before any observer sees the commands.
  virtual void override_commands(Span<Command> /*commands_inout*/) {}
  virtual void before_step(Span<const Command> /*commands*/) {}
  virtual void after_step(const StepResult& /*result*/) {}
  /// Called after new episodes that no step began, in the worlds of the mask [worlds]; empty: in all worlds.
  virtual void after_reset(Span<const uint8_t> /*world_mask*/) {}
};

/// Takes a step by these commands [slots]. Observers enclose the step like nested scopes: they are called in their
/// order before it, and in reverse order after it.
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
