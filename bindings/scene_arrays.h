// Conversion of scenes to and from dicts of NumPy arrays, for pictura.Scenario.from_arrays() and to_arrays().
#pragma once

#include <optional>
#include <string>

#include <pybind11/pybind11.h>

#include "pictura/map/scenario/logged_scene.h"

namespace pictura::python {

namespace py = pybind11;

/// Arguments of from_arrays(). Optional dicts may be missing.
struct SceneArrays {
  py::dict tracks, lanes;
  std::optional<py::dict> lines, edges, crosswalks, stop_signs, lights;
};

/// Converts arrays to a scene: its tracks, map and lights. Throws UsageError for an invalid array; the message contains
/// the array's name, the element if there is one, and the expected and actual values.
LoggedScene scene_from_arrays(const SceneArrays& arrays);

/// Converts a scene to dicts. The keys of the result are the names of the arguments of from_arrays().
py::dict to_arrays(const LoggedScene& scene);

/// Adds LINE_TYPES and LIGHT_STATES to the module.
void bind_scene_names(py::module_& module);

}  // namespace pictura::python
