#include "pictura/simulator/drive_steps.h"

#include "pictura/common/support/interrupt.h"

namespace pictura {

DriveEnd drive_steps(Simulator& simulator, Span<Command> commands, int steps, const std::function<bool(int)>& act,
                     const std::vector<StepObserver*>& observers,
                     const std::function<void(int, const StepResult&)>& on_step) {
  for (int step = 0; step < steps; ++step) {
    if (interrupted()) return {step, true};
    if (!act(step)) return {step};
    const StepResult result = step_observed(simulator, commands, observers);
    if (on_step) on_step(step, result);
  }
  return {steps};
}

DriveEnd drive_steps(Simulator& simulator, Controller& controller, int steps,
                     const std::vector<StepObserver*>& observers,
                     const std::function<void(int, const StepResult&)>& on_step) {
  std::vector<Command> commands(static_cast<size_t>(simulator.num_slots()));
  const auto act = [&](int) {
    controller.act(simulator.arrays(), {}, commands);
    return true;
  };
  return drive_steps(simulator, commands, steps, act, observers, on_step);
}

}  // namespace pictura
