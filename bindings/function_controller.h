// Drivers that call a Python function. Evaluations accept such a function instead of a controller's name, and probes
// accept it instead of a policy's file.
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

/// Returns a function that makes controllers. These call function(observations); `observations` is a dict of NumPy
/// arrays [agents, ...]. The function must return either actions, int [agents], or logits [agents, kNumActions] and
/// values [agents]. From logits, actions are chosen as for a saved policy, by the options' argmax and seed. With a
/// renderer, observations also contain images: `rgb`, u8 [agents, cameras, 3, height, width], black for inactive
/// agents; `rgb_0`, `rgb_1`, ... if the cameras have several sizes. Simulator and renderer must work in host memory;
/// otherwise the controllers throw Error. They throw UsageError if the function returns neither actions nor logits with
/// values, and pass on exceptions that the function raises.
std::function<std::unique_ptr<Controller>(const DriverOptions&, const Simulator&, Renderer*)> function_controllers(
    const py::function& function);

/// Returns a function that makes sessions in which such a Python function is the policy. The sessions work on the host,
/// with the default configuration and the cameras of the options. If the function returns actions, the chosen action
/// has probability 1 and the value is NaN. Throws UsageError if the options specify another device or decision_steps.
/// The sessions throw as the controllers do.
std::function<std::unique_ptr<PolicySession>(const DriverOptions&)> function_sessions(const py::function& function);

}  // namespace pictura::python
