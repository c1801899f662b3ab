// Scenes in TOML files (docs/reference/scene_file.md), for `pictura render`, tests and reports of wrong images.
#pragma once

#include <string>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/common/renderer.h"

namespace pictura {

/// A scene of one world, with a renderer's other inputs.
struct SceneFile {
  RendererConfig config;  // rig, line floor and palette
  StaticGeometry geometry;
  SceneOwner scene;  // geometry handle 0
  std::vector<View> views;
  std::vector<std::string> view_names, view_captions;  // [views]; names are valid file names
};

/// Parses a scene's text. Paths of rig files are relative to `folder`. Throws Error, naming source, line, table and
/// key, for any invalid key or value.
SceneFile parse_scene(const std::string& text, const std::string& source, const std::string& folder = ".");

/// Reads a scene file of up to 1 MiB.
SceneFile load_scene(const std::string& path);

}  // namespace pictura
