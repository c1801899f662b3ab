// Controllers that call a Python function. Evaluations accept such a function instead of a controller's name.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include <pybind11/pybind11.h>

#include "pictura/common/renderer.h"
#include "pictura/simulator/controllers/controller.h"
#include "pictura/simulator/simulator.h"

namespace pictura::python {

namespace py = pybind11;

/// Returns "function NAME" for a function. For another callable object, NAME is the name of its class.
std::string name_of_function(const py::function& function);

/// Returns a function that makes controllers. These call function(observations), which must return actions, int
/// [slots]; `observations` is a dict of NumPy arrays [slots, ...]. With a renderer, observations also contain images:
/// `rgb`, u8 [slots, cameras, 3, height, width], black for inactive agents; `rgb_0`, `rgb_1`, ... if the cameras have
/// several sizes. Simulator and renderer must work in host memory; otherwise the controllers throw Error. They throw
/// UsageError if the function returns anything except actions, and pass on exceptions that the function raises.
std::function<std::unique_ptr<Controller>(const Simulator&, Renderer*)> function_controllers(
    const py::function& function);

}  // namespace pictura::python
