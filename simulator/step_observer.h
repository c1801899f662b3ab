// The interface of what follows a simulator step by step (recorders, live views, probes), and the step that notifies
// it.
#pragma once

#include "pictura/simulator/simulator.h"

namespace pictura {

/// An observer of a simulator's steps. All spans lie in the simulator's memory.
class StepObserver {
 public:
  virtual ~StepObserver() = default;
  /// Whether the next step may be taken; waits for it a little.
  virtual bool is_due() { return true; }
  /// Gives agents that it drives other commands, of [slots], before any observer sees them.
  virtual void override_commands(Span<Command> /*commands_inout*/) {}
  virtual void before_step(Span<const Command> /*commands*/) {}
  virtual void after_step(const StepResult& /*result*/) {}
  /// After new episodes that no step began, of the worlds of the mask [worlds]; empty: of all.
  virtual void after_reset(Span<const uint8_t> /*world_mask*/) {}
};

/// Steps by these commands [slots]. Observers enclose the step as nested scopes do: before it they are called in their
/// order, after it in the reverse order.
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
