// Python function as a driver: as a controller, which evaluations accept in place of a controller's name, and as a
// policy, which probes accept in place of a file.
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

/// Returns "function NAME" for a function. For another callable object, NAME is the name of its class.
std::string name_of_function(const py::function& function);

/// Makes controllers that call function(observations), NumPy's arrays [agents, ...] by name. The function returns
/// actions int [agents], or logits [agents, kNumActions] and values [agents], from which argmax and seed of the options
/// choose as for a saved policy. With a renderer, observations have images as well: `rgb` u8 [agents, cameras, 3,
/// height, width], black for inactive agents; `rgb_0`, `rgb_1`, ... if the cameras have several sizes. The controllers
/// throw Error if the simulator is not on the host, UsageError if the function returns anything else, and exceptions
/// that the function raises.
std::function<std::unique_ptr<Controller>(const DriverOptions&, const Simulator&, Renderer*)> function_controllers(
    const py::function& function);

/// Makes sessions in which such a function is the policy, on the host and in the paper's world, with the cameras that
/// the options define. An action without logits has probability 1, and its value is NaN. Throws UsageError if the
/// options specify another device or held actions; the sessions throw as the controllers do.
std::function<std::unique_ptr<PolicySession>(const DriverOptions&)> function_sessions(const py::function& function);

}  // namespace pictura::python
