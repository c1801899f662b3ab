// Common part of pictura._driving and pictura._training_MAJOR_MINOR.
#pragma once

#include <pybind11/pybind11.h>

namespace pictura::python {

/// Adds the evaluations, the probes and PolicySession.
void bind_driving(pybind11::module_& module);

}  // namespace pictura::python
