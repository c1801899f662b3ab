// Scenes as dicts of NumPy arrays: arguments of pictura.Scenario.from_arrays() and results of to_arrays().
#pragma once

#include <optional>
#include <string>

#include <pybind11/pybind11.h>

#include "pictura/map/scenario/logged_scene.h"

namespace pictura::python {

namespace py = pybind11;

/// Dicts of from_arrays(); those without a value are absent.
struct SceneArrays {
  py::dict tracks, lanes;
  std::optional<py::dict> lines, edges, crosswalks, stop_signs, lights;
};

/// Returns the scene of these arrays: its tracks, its map and its lights. Throws UsageError naming the array, and the
/// element if there is one, the expected and the actual value.
LoggedScene scene_from_arrays(const SceneArrays& arrays);

/// Returns the dicts of a scene by their argument names in from_arrays().
py::dict to_arrays(const LoggedScene& scene);

/// Adds LINE_TYPES and LIGHT_STATES to the module.
void bind_scene_names(py::module_& module);

}  // namespace pictura::python
