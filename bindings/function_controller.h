// A function of Python's that drives: what evaluations take in the place of a controller's name.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include <pybind11/pybind11.h>

#include "pictura/simulator/controllers/controller.h"
#include "pictura/simulator/simulator.h"

namespace pictura::python {

namespace py = pybind11;

/// "function NAME" of a function or of an object's class.
std::string name_of_function(const py::function& function);

/// Makes controllers that call function(observations), NumPy's arrays [slots, ...] by name, for actions int [slots].
/// They throw Error where the simulator is not on the host, UsageError where what comes back is something else, and
/// what the function raises.
std::function<std::unique_ptr<Controller>(const Simulator&)> function_controllers(const py::function& function);

}  // namespace pictura::python
