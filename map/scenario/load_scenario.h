// Loading of scenes by the name that a user gives as SCENE: load_scenario() alone knows all formats of scene files.
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
  int32_t record = -1;             // in a TFRecord file; -1: the file is the scene
  uint64_t offset = 0, bytes = 0;  // place and size of the record's payload
  std::string id;                  // scenario_id if the index has it, or empty
};

struct SceneIndex {
  std::vector<SceneRef> scenes;     // files in order of their names, records in file order
  std::vector<std::string> faults;  // omitted files and omitted ends of files, with the reasons
};

/// Details of how a scene was loaded.
struct SceneReport {
  bool cached = false;
  std::string cache_rejection;  // reason why an existing cached file was not used, or empty
};

/// Whether a name is that of a scene rather than of a map: FILE.json, FILE.bin, FILE.scenario, a file with `.tfrecord`
/// in its name, or a folder; each with or without #K or #SCENARIO_ID.
bool is_scene_name(std::string_view name);

/// Lists the scenes of a file or a folder. Records are found from their lengths and ids. The ids of a TFRecord file are
/// cached (cache_folder("scenes")) while the records' lengths and checksums stay the same. Throws Error when there is
/// no such file or folder, and when a folder holds no scene.
SceneIndex index_scenes(const std::string& path);

/// Returns all scenes of a name: with a selector, the scene of find_scene(); else all scenes of the file or folder.
SceneIndex find_scenes(const std::string& name);

/// Returns the scene of a name: FILE, FILE#K (from 0), FILE#SCENARIO_ID, FOLDER#K or FOLDER#SCENARIO_ID; without a
/// selector, the first scene. Throws UsageError for an invalid name or selector, and Error naming file, record and
/// field.
SceneRef find_scene(const std::string& name);

/// Loads a scene, from the cache if it is there. Throws Error naming file, record and field.
Scenario load_scenario(const SceneRef& scene, SceneReport* report_out = nullptr);
Scenario load_scenario(const std::string& name, SceneReport* report_out = nullptr);

/// Parses a scene from its file's bytes, without caching. `name`, the file's name, determines the format and appears in
/// messages. `record` selects the record of a TFRecord file.
Scenario parse_scenario_file(std::string_view bytes, const std::string& name, int32_t record = 0);

}  // namespace pictura
