// Who sees every step of a simulator: recorders, live views, probes, films; and the loop's one step that shows it to
// them.
#pragma once

#include "pictura/simulator/simulator.h"

namespace pictura {

/// Sees the steps of a simulator, whose memory all spans are in.
class StepObserver {
 public:
  virtual ~StepObserver() = default;
  /// Whether the next step may be taken; waits for it a little.
  virtual bool is_due() { return true; }
  /// Gives agents that it drives other commands, of [slots], before any observer sees them.
  virtual void drive(Span<Command> /*commands_inout*/) {}
  virtual void before_step(Span<const Command> /*commands*/) {}
  virtual void after_step(const StepResult& /*result*/) {}
  /// After new episodes that no step began, of the worlds of the mask [worlds]; empty: of all.
  virtual void after_reset(Span<const uint8_t> /*world_mask*/) {}
};

/// One step by these commands [slots]. Observers see it as scopes around it: what comes before in their order, what
/// comes after in the reverse.
template <typename Observers>
StepResult step_observed(Simulator& simulator, Span<Command> commands_inout, const Observers& observers,
                         Stream stream = {}) {
  for (const auto& observer : observers) observer->drive(commands_inout);
  for (const auto& observer : observers) observer->before_step(Span<const Command>(commands_inout));
  const StepResult result = simulator.step(Span<const Command>(commands_inout), stream);
  for (auto observer = observers.rbegin(); observer != observers.rend(); ++observer) (*observer)->after_step(result);
  return result;
}

}  // namespace pictura
