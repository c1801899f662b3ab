// Python function as a controller, which evaluations accept in place of a controller's name.
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

/// Returns "function NAME" of a function or of an object's class.
std::string name_of_function(const py::function& function);

/// Makes controllers that call function(observations), NumPy's arrays [slots, ...] by name, for actions int [slots].
/// With a renderer, observations have images as well: `rgb` u8 [slots, cameras, 3, height, width], black for inactive
/// agents; `rgb_0`, `rgb_1`, ... if the cameras have several sizes. The controllers throw Error if the simulator or the
/// renderer is not on the host, UsageError if the function returns anything else, and exceptions that the function
/// raises.
std::function<std::unique_ptr<Controller>(const Simulator&, Renderer*)> function_controllers(
    const py::function& function);

}  // namespace pictura::python
