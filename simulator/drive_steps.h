// Main loop of driving a simulator: check for ^C, commands, a step.
#pragma once

#include <functional>
#include <vector>

#include "pictura/simulator/controllers/controller.h"
#include "pictura/simulator/step_observer.h"

namespace pictura {

/// Result of drive_steps().
struct DriveEnd {
  int steps = 0;  // number of steps taken
  bool is_interrupted = false;
};

/// Takes at most `steps` steps by the commands [slots] that act(step) writes, through step_observed(), and calls
/// on_step(step, result) after each. Ends before the first step that ^C precedes, or for which act() returns false.
DriveEnd drive_steps(Simulator& simulator, Span<Command> commands, int steps, const std::function<bool(int)>& act,
                     const std::vector<StepObserver*>& observers = {},
                     const std::function<void(int, const StepResult&)>& on_step = {});
/// Takes steps by the commands of a controller, which acts for all agents of a simulator in host memory.
DriveEnd drive_steps(Simulator& simulator, Controller& controller, int steps,
                     const std::vector<StepObserver*>& observers = {},
                     const std::function<void(int, const StepResult&)>& on_step = {});

}  // namespace pictura
