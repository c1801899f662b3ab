// Loads scenes by the name that a user gives after SCENE: the one function that knows all formats of scene files.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/map/scenario/scenario.h"

namespace pictura {

/// Where one scene is.
struct SceneRef {
  std::string file;
  int32_t record = -1;             // in a TFRecord file; -1: the file is the scene
  uint64_t offset = 0, bytes = 0;  // of the record's payload
  std::string id;                  // scenario_id where the index knows it, or empty
};

struct SceneIndex {
  std::vector<SceneRef> scenes;     // files in order of their names, records in the file's
  std::vector<std::string> faults;  // files, and ends of files, that are left out, and why
};

/// How a scene was loaded.
struct SceneReport {
  bool cached = false;
  std::string cache_rejection;  // why an existing cached file was not used, or empty
};

/// Whether a name is a scene's rather than a map's: FILE.json, FILE.bin, FILE.scenario, a file with `.tfrecord` in its
/// name, or a folder; each with or without #K or #SCENARIO_ID.
bool is_scene_name(std::string_view name);

/// The scenes of a file or a folder. Records are found from their lengths and ids; the ids of a TFRecord file are kept
/// in the cache (cache_folder("scenes")) for as long as the records' lengths and checksums stay. Throws Error when
/// there is no such file or folder, and when a folder holds no scene.
SceneIndex index_scenes(const std::string& path);

/// All scenes that a name says: with a selector the one of find_scene(), else those of the file or folder.
SceneIndex find_scenes(const std::string& name);

/// The scene that a name says: FILE, FILE#K (from 0), FILE#SCENARIO_ID, FOLDER#K, FOLDER#SCENARIO_ID; without a
/// selector the first one. Throws UsageError for a name or selector that is none, Error naming file, record and field.
SceneRef find_scene(const std::string& name);

/// The scene, from the cache where that has it. Throws Error naming file, record and field.
Scenario load_scenario(const SceneRef& scene, SceneReport* report_out = nullptr);
Scenario load_scenario(const std::string& name, SceneReport* report_out = nullptr);

/// A scene from its file's bytes, by the file's name: `name` says the format and is named in messages. In a TFRecord
/// file, the record of that number. Nothing is cached.
Scenario parse_scenario_file(std::string_view bytes, const std::string& name, int32_t record = 0);

}  // namespace pictura
