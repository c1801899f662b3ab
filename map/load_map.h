// Loads maps by the name that a user gives after MAP: the one function that knows all kinds of maps.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/map/opendrive/opendrive.h"
#include "pictura/map/road_map.h"

namespace pictura {

/// How a map was loaded.
struct LoadReport {
  bool cached = false;          // the map was read from the cache
  std::string cache_rejection;  // why an existing cached file was not used, or empty
  std::string source;           // the file, or the procedural town's name: names it in messages
};

/// Loads `name`: a file (.xodr), a town's name looked up as NAME.xodr in the map folder,
/// `procedural[:SEED[:NAME=VALUE,...]]`, `city[...]` likewise, or one of these with #COPY behind it, its affine copy of
/// that number (map_copy.h), which replaces options.plan. Files and their copies are imported once and stored in the
/// cache (map_cache.h); a cache that cannot be read or written only costs time. Throws Error naming the file and the
/// line or element; UsageError when there is no such map.
std::shared_ptr<const RoadMap> load_map(const std::string& name, const OpenDriveOptions& options = {},
                                        LoadReport* report_out = nullptr, const ImportProgress& progress = {});

struct MapText {
  std::string text, source;  // OpenDRIVE, and its name in messages
};

/// Several by num_threads host threads (0: all); throws as load_map() does.
std::vector<std::shared_ptr<const RoadMap>> load_maps(const std::vector<std::string>& names, int num_threads = 0);

/// The text that load_map() would import for this name. Throws as load_map() does, and UsageError for copies, which
/// have none.
MapText map_text(const std::string& name);

/// The size of a map's file; of a procedural town, about that of a CARLA file with as much road. Memory is estimated
/// from it. Throws as load_map() does.
int64_t map_file_bytes(const std::string& name);

/// Whether a name is a file's or its copy's, rather than a town's or a procedural map's.
bool is_map_file(std::string_view name);

/// $PICTURA_DATA, or $XDG_DATA_HOME/pictura/maps, or ~/.local/share/pictura/maps. CARLA's towns are looked up here and
/// in its subfolder `carla`.
std::string map_folder();

/// The names of the towns in the map folder, sorted.
std::vector<std::string> known_towns();

}  // namespace pictura
