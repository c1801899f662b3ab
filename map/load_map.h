// Loading of maps by the name that a user gives as MAP: load_map() alone knows all kinds of maps.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/map/opendrive/opendrive.h"
#include "pictura/map/road_map.h"

namespace pictura {

/// Details of how a map was loaded.
struct LoadReport {
  bool cached = false;          // the map was read from the cache
  std::string cache_rejection;  // reason why an existing cached file was not used, or empty
  std::string source;           // the file or the procedural town's name, for messages
};

/// Loads `name`: an OpenDRIVE file (.xodr), a Lanelet2 file (.osm), a town (NAME.xodr in the map folder),
/// `procedural[:SEED[:NAME=VALUE,...]]`, or `city[...]` likewise. FILE.osm@LATITUDE,LONGITUDE has coordinates about
/// that place. MAP#N is the N-th affine copy of MAP (map_copy.h), whose plan replaces options.plan. Files and their
/// copies are imported once and stored in the cache (map_cache.h); a cache that cannot be read or written only costs
/// time. Throws Error naming the file and the line or element; UsageError when there is no such map.
std::shared_ptr<const RoadMap> load_map(const std::string& name, const OpenDriveOptions& options = {},
                                        LoadReport* report_out = nullptr, const ImportProgress& progress = {});

struct MapText {
  std::string text, source;  // OpenDRIVE, and its name in messages
};

/// Loads several maps on num_threads host threads (0: all). Throws as load_map() does.
std::vector<std::shared_ptr<const RoadMap>> load_maps(const std::vector<std::string>& names, int num_threads = 0);

/// Returns the text that load_map() would import for this name. Throws as load_map() does, and UsageError for copies,
/// which have no text, and for Lanelet2 files, which are not OpenDRIVE.
MapText map_text(const std::string& name);

/// Returns the size of a map's file, from which memory is estimated. For a procedural town, it is about the size of a
/// CARLA file with as much road. Throws as load_map() does.
int64_t map_file_bytes(const std::string& name);

/// Whether a name is that of a file or of its copy, rather than of a town or a procedural map.
bool is_map_file(std::string_view name);

/// Folder of maps: $PICTURA_DATA, or $XDG_DATA_HOME/pictura/maps, or ~/.local/share/pictura/maps. CARLA's towns are
/// looked up there and in its subfolder `carla`.
std::string map_folder();

/// Returns the names of the towns in the map folder, sorted.
std::vector<std::string> known_towns();

}  // namespace pictura
