// Loads recorded scenes by the name that users give as SCENE. No other file knows all formats of scene files.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/map/scenario/scenario.h"

namespace pictura {

/// Location of one scene.
struct SceneRef {
  std::string file;
  int32_t record = -1;             // index in a TFRecord file; -1: the file is the scene
  uint64_t offset = 0, bytes = 0;  // offset and size of the record's payload
  std::string id;                  // scenario_id if known, or empty
};

struct SceneIndex {
  std::vector<SceneRef> scenes;     // files in order of their names, records in file order
  std::vector<std::string> faults;  // reasons why files or ends of files are omitted
};

/// Details of how a scene was loaded.
struct SceneReport {
  bool cached = false;
  std::string cache_rejection;  // reason why an existing cached file was not used, or empty
};

/// Whether a name is the name of a scene rather than of a map. Scenes are FILE.json, FILE.bin, FILE.scenario, files
/// with `.tfrecord` in their name, and folders, each with or without #K or #SCENARIO_ID.
bool is_scene_name(std::string_view name);

/// Lists the scenes of a file or a folder. Only lengths and ids of records are read. The ids of a TFRecord file are
/// cached (cache_folder("scenes")); the cache is valid while the lengths and checksums of the records do not change.
/// Throws Error if the file or folder does not exist or a folder has no scene.
SceneIndex index_scenes(const std::string& path);

/// Returns the scenes of a name. A name with a selector (#K or #SCENARIO_ID) has one scene; see find_scene(). Other
/// names have all scenes of the file or folder.
SceneIndex find_scenes(const std::string& name);

/// Returns the scene of a name: FILE, FILE#K, FILE#SCENARIO_ID, FOLDER, FOLDER#K or FOLDER#SCENARIO_ID. K counts from
/// 0. A name without a selector means the first scene. Throws UsageError for an invalid selector, and Error, which
/// names the file, for a file that cannot be indexed.
SceneRef find_scene(const std::string& name);

/// Loads a scene, from the cache if it is cached. Throws Error, which names file, record and field, if the file is
/// faulty.
Scenario load_scenario(const SceneRef& scene, SceneReport* report_out = nullptr);
Scenario load_scenario(const std::string& name, SceneReport* report_out = nullptr);

/// Parses a scene from its file's bytes, without caching. `name` is the file's name; it determines the format and
/// appears in messages. `record` selects the record of a TFRecord file.
Scenario parse_scenario_file(std::string_view bytes, const std::string& name, int32_t record = 0);

}  // namespace pictura
