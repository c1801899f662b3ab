// Functions of pictura._driving (without torch) and pictura._training_MAJOR_MINOR (with torch).
#pragma once

#include <pybind11/pybind11.h>

namespace pictura::python {

/// Adds evaluations, probes and PolicySession.
void bind_driving(pybind11::module_& module);

}  // namespace pictura::python
