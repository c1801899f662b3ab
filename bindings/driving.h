// Functions of the extension modules pictura._driving (without torch) and pictura._training_MAJOR_MINOR (for one
// version of torch).
#pragma once

#include <pybind11/pybind11.h>

namespace pictura::python {

/// Adds evaluations, probes and PolicySession to a module.
void bind_driving(pybind11::module_& module);

}  // namespace pictura::python
