// A scene in one TOML file: boxes, lines, walls, lights, a rig and views. docs/reference/scene_file.md documents every
// key. `pictura render` and the golden tests draw scene files, and reports of wrong images should contain one.
#pragma once

#include <string>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/common/renderer.h"

namespace pictura {

/// Input of a renderer for a scene of one world on one map.
struct SceneFile {
  RendererConfig config;  // rig, line floor and palette
  StaticGeometry geometry;
  SceneOwner scene;  // its world's geometry handle is 0
  std::vector<View> views;
  std::vector<std::string> view_names, view_captions;  // [views]; names can be used as file names
};

/// Parses a scene's text. Paths of rig files are relative to `folder`. Throws Error naming source, line, table and key
/// for unknown and missing keys, wrong types, numbers out of range and indices of agents that do not exist.
SceneFile parse_scene(const std::string& text, const std::string& source, const std::string& folder = ".");

/// Reads a scene file of up to 1 MiB.
SceneFile load_scene(const std::string& path);

}  // namespace pictura
