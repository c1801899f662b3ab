// Scenes as dicts of NumPy arrays: what pictura.Scenario.from_arrays() takes and to_arrays() gives.
#pragma once

#include <optional>
#include <string>

#include <pybind11/pybind11.h>

#include "pictura/map/scenario/logged_scene.h"

namespace pictura::python {

namespace py = pybind11;

/// The dicts of from_arrays(), of which those without a value have nothing.
struct SceneArrays {
  py::dict tracks, lanes;
  std::optional<py::dict> lines, edges, crosswalks, stop_signs, lights;
};

/// The scene that arrays state: its tracks, its map and its lights. Throws UsageError naming the array, and the element
/// where there is one, what was expected and what came.
LoggedScene scene_from_arrays(const SceneArrays& arrays);

/// The dicts of a stated scene by their names as arguments of from_arrays().
py::dict to_arrays(const LoggedScene& scene);

/// LINE_TYPES and LIGHT_STATES of the module.
void bind_scene_names(py::module_& module);

}  // namespace pictura::python
