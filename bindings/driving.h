// What pictura._driving and pictura._training_MAJOR_MINOR have in common.
#pragma once

#include <pybind11/pybind11.h>

namespace pictura::python {

/// Adds evaluate(), evaluate_scenes(), the probes and PolicySession.
void bind_driving(pybind11::module_& module);

}  // namespace pictura::python
