// Loads maps by the name that users give as MAP. No other file knows all kinds of maps.
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
/// `procedural[:SEED[:NAME=VALUE,...]]`, or `city[:SEED[:NAME=VALUE,...]]`. FILE.osm@LATITUDE,LONGITUDE sets the origin
/// of the file's coordinates to that place. MAP#N is the N-th affine copy of MAP (map_copy.h); the copy's plan replaces
/// options.plan. Imported files and their copies are stored in a cache (map_cache.h). If the cache cannot be read or
/// written, the file is imported again. Throws Error, which names the file and the line or element, if the file is
/// faulty. Throws UsageError if no map has this name.
std::shared_ptr<const RoadMap> load_map(const std::string& name, const OpenDriveOptions& options = {},
                                        LoadReport* report_out = nullptr, const ImportProgress& progress = {});

struct MapText {
  std::string text, source;  // the OpenDRIVE text, and its name in messages
};

/// Loads several maps on num_threads host threads (0: one per processor). Throws as load_map() does.
std::vector<std::shared_ptr<const RoadMap>> load_maps(const std::vector<std::string>& names, int num_threads = 0);

/// Returns the OpenDRIVE text that load_map() imports for this name. Throws as load_map() does. Throws UsageError also
/// for copies, which have no text of their own, and for Lanelet2 files.
MapText map_text(const std::string& name);

/// Returns the size of a map's file in bytes, for estimates of memory. For a procedural town, returns the approximate
/// size of a CARLA file with as much road. Throws UsageError if no map has this name.
int64_t map_file_bytes(const std::string& name);

/// Whether a name refers to a map file or a copy of a map file, rather than to a town or a procedural map.
bool is_map_file(std::string_view name);

/// Returns the folder of maps: $PICTURA_DATA if set, else $XDG_DATA_HOME/pictura/maps if XDG_DATA_HOME is set, else
/// ~/.local/share/pictura/maps. Towns are searched for there and in the subfolder `carla`.
std::string map_folder();

/// Returns the names of the towns in the map folder, sorted.
std::vector<std::string> known_towns();

}  // namespace pictura
