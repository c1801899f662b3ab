// The loop in which a simulator is driven: a question for ^C, commands, a step.
#pragma once

#include <functional>
#include <vector>

#include "pictura/simulator/controllers/controller.h"
#include "pictura/simulator/step_observer.h"

namespace pictura {

/// How drive_steps() ended.
struct DriveEnd {
  int steps = 0;  // that were taken
  bool is_interrupted = false;
};

/// Steps at most `steps` times by the commands [slots] that act(step) writes, as step_observed() does, and calls
/// on_step(step, result) after each. Ends before the first step that ^C precedes, or for which act() returns false.
DriveEnd drive_steps(Simulator& simulator, Span<Command> commands, int steps, const std::function<bool(int)>& act,
                     const std::vector<StepObserver*>& observers = {},
                     const std::function<void(int, const StepResult&)>& on_step = {});
/// Steps likewise by the commands of a controller, which acts for all agents of a simulator in host memory.
DriveEnd drive_steps(Simulator& simulator, Controller& controller, int steps,
                     const std::vector<StepObserver*>& observers = {},
                     const std::function<void(int, const StepResult&)>& on_step = {});

}  // namespace pictura
