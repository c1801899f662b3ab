// Python functions as drivers, instead of a controller's name or a policy's file.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include <pybind11/pybind11.h>

#include "pictura/common/renderer.h"
#include "pictura/evaluation/evaluated_driver.h"
#include "pictura/policy/session.h"

namespace pictura::python {

namespace py = pybind11;

/// Returns "function NAME"; for another callable object, NAME is its class.
std::string name_of_function(const py::function& function);

/// Returns a function that makes controllers, which call function(observations) with a dict of NumPy arrays [agents,
/// ...]. `function` returns actions, int [agents], or logits [agents, kNumActions] and values [agents].
/// DriverOptions::argmax and DriverOptions::seed determine the choice of actions from logits. A renderer adds images:
/// `rgb`, u8 [agents, cameras, 3, height, width], black for inactive agents; `rgb_0`, `rgb_1`, ... for several sizes.
/// The returned function throws Error unless the simulator is on the host; controllers throw UsageError for invalid
/// results of `function`, and pass on the exceptions that it throws.
std::function<std::unique_ptr<Controller>(const DriverOptions&, const Simulator&, Renderer*)> function_controllers(
    const py::function& function);

/// Returns a function that makes sessions on the host. Their policy is `function`, with the default configuration and
/// the options' cameras. If `function` returns actions, each has probability 1 and the value is NaN. The returned
/// function throws UsageError for devices other than the host, or if decision_steps is positive. Sessions throw as
/// controllers do.
std::function<std::unique_ptr<PolicySession>(const DriverOptions&)> function_sessions(const py::function& function);

}  // namespace pictura::python
