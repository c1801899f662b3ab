// Main loop that drives a simulator.
#pragma once

#include <functional>
#include <vector>

#include "pictura/simulator/controllers/controller.h"
#include "pictura/simulator/step_observer.h"

namespace pictura {

/// Result of drive_steps().
struct DriveEnd {
  int steps = 0;
  bool is_interrupted = false;
};

/// Takes at most `steps` steps. Before each step, act(step) writes `commands` [slots]; after it, on_step(step, result)
/// is called. Ends early on ^C, or if act() returns false.
DriveEnd drive_steps(Simulator& simulator, Span<Command> commands, int steps, const std::function<bool(int)>& act,
                     const std::vector<StepObserver*>& observers = {},
                     const std::function<void(int, const StepResult&)>& on_step = {});
/// Variant with a controller of all agents. The simulator must work in host memory.
DriveEnd drive_steps(Simulator& simulator, Controller& controller, int steps,
                     const std::vector<StepObserver*>& observers = {},
                     const std::function<void(int, const StepResult&)>& on_step = {});

}  // namespace pictura
