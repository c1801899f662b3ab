// Loads recorded scenes by the name that users give as SCENE.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/map/scenario/scenario.h"

namespace pictura {

struct SceneRef {
  std::string file;
  int32_t record = -1;             // index in a TFRecord file; -1: the file is the scene
  uint64_t offset = 0, bytes = 0;  // payload of the record
  std::string id;                  // scenario_id in a TFRecord file, or empty if unknown
};

struct SceneIndex {
  std::vector<SceneRef> scenes;     // sorted by file, then by record
  std::vector<std::string> faults;  // why a file, or the rest of a file, is omitted
};

struct SceneReport {
  bool cached = false;
  std::string cache_rejection;  // why an existing cached file was not used
};

/// Whether the name is a scene's. Scenes are folders, FILE.json, FILE.bin, FILE.scenario and files with `.tfrecord` in
/// their name. #K or #SCENARIO_ID may follow.
bool is_scene_name(std::string_view name);

/// Lists the scenes of a file or folder. Reads only lengths and ids of records. The ids of a TFRecord file are cached
/// until its records change. Throws Error if the path does not exist or a folder has no scene.
SceneIndex index_scenes(const std::string& path);

/// Returns the scene of a name with a selector (#K or #SCENARIO_ID), else all scenes of the file or folder.
SceneIndex find_scenes(const std::string& name);

/// Returns the scene of a name: a file or folder, optionally with #K (from 0) or #SCENARIO_ID. The default is the first
/// scene. Loads files other than TFRecords one after the other to find an id. Throws UsageError for an invalid
/// selector. Throws Error, which names the file, for a file that cannot be indexed.
SceneRef find_scene(const std::string& name);

/// Loads a scene, from the cache if possible. Throws Error, which names file, record and field, for a faulty file.
Scenario load_scenario(const SceneRef& scene, SceneReport* report_out = nullptr);
Scenario load_scenario(const std::string& name, SceneReport* report_out = nullptr);

/// Parses a scene from its file's bytes, without caching. The file's name determines the format, and appears in
/// messages. `record` selects a record of a TFRecord file.
Scenario parse_scenario_file(std::string_view bytes, const std::string& name, int32_t record = 0);

}  // namespace pictura
