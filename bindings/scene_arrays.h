// Scenes as dicts of NumPy arrays, for pictura.Scenario.from_arrays() and to_arrays().
#pragma once

#include <optional>
#include <string>

#include <pybind11/pybind11.h>

#include "pictura/map/scenario/logged_scene.h"

namespace pictura::python {

namespace py = pybind11;

struct SceneArrays {
  py::dict tracks, lanes;
  std::optional<py::dict> lines, edges, crosswalks, stop_signs, lights;
};

/// Throws UsageError naming the array, the element if any, and the expected and actual values.
LoggedScene scene_from_arrays(const SceneArrays& arrays);

/// The keys are the arguments of from_arrays().
py::dict to_arrays(const LoggedScene& scene);

/// Adds LINE_TYPES and LIGHT_STATES to the module.
void bind_scene_names(py::module_& module);

}  // namespace pictura::python
