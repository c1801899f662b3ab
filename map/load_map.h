// From what a user writes after MAP to a RoadMap: the one function that knows all kinds of maps.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "pictura/map/opendrive/opendrive.h"
#include "pictura/map/road_map.h"

namespace pictura {

/// How a map came to be loaded.
struct LoadReport {
  bool cached = false;                // the map is the one that an earlier load left in the cache
  std::string cache_refusal;          // why a cached file was there and not used, or empty
  std::vector<std::string> warnings;  // what a lenient import left out
};

/// Loads `name`: a file (.xodr), a town's name looked up as NAME.xodr in the map folder, or
/// `procedural[:SEED[:NAME=VALUE,...]]`. Files are imported once and, where that gave no warnings, kept in the cache
/// (map_cache.h); a cache that cannot be read or written costs time alone. Throws Error naming the file and the line or
/// element; UsageError when there is no such map.
std::shared_ptr<const RoadMap> load_map(const std::string& name, const OpenDriveOptions& options = {},
                                        LoadReport* report_out = nullptr);

struct MapText {
  std::string text, source;  // OpenDRIVE, and what messages call it
};

/// What load_map() would import for this name. Throws as it does.
MapText map_text(const std::string& name);

/// $PICTURA_DATA, or $XDG_DATA_HOME/pictura/maps, or ~/.local/share/pictura/maps. CARLA's towns are looked for here and
/// in its folder `carla`.
std::string map_folder();

/// The towns that the map folder holds, by name, sorted.
std::vector<std::string> known_towns();

}  // namespace pictura
