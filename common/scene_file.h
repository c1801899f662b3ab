// A scene in one TOML file: boxes, lines, walls, lights, a rig and views. docs/reference/scene_file.md documents every
// key. `pictura render` and the tests of golden images draw scene files. A report of a wrong image should contain a
// scene file.
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
  std::vector<std::string> view_names, view_captions;  // [views]; each name is a valid file name
};

/// Parses a scene's text. Paths of rig files are relative to `folder`. Throws Error for unknown and missing keys, wrong
/// types, numbers out of range and indices of agents that do not exist. The message names source, line, table and key.
SceneFile parse_scene(const std::string& text, const std::string& source, const std::string& folder = ".");

/// Reads a scene file of up to 1 MiB.
SceneFile load_scene(const std::string& path);

}  // namespace pictura
