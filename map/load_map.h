// Loads maps by the name that users give as MAP.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/map/opendrive/opendrive.h"
#include "pictura/map/road_map.h"

namespace pictura {

struct LoadReport {
  bool cached = false;
  std::string cache_rejection;  // why an existing cached file was not used
  std::string source;           // name in messages
};

/// Loads a map by its name:
/// FILE.xodr: an OpenDRIVE file
/// FILE.osm[@LATITUDE,LONGITUDE]: a Lanelet2 file and, optionally, the origin of its coordinates
/// TOWN: TOWN.xodr in the map folder
/// FAMILY[:SEED[:NAME=VALUE,...]]: a procedural town (town_options.h)
/// MAP#N: the N-th affine copy of MAP (map_copy.h), whose plan replaces options.plan
///
/// Caches imported files; ignores an unusable cache. Throws Error, which names file and line or element, for a faulty
/// file. Throws UsageError for an unknown name.
std::shared_ptr<const RoadMap> load_map(const std::string& name, const OpenDriveOptions& options = {},
                                        LoadReport* report_out = nullptr, const ImportProgress& progress = {});

struct MapText {
  std::string text, source;  // `source` is the name in messages
};

/// Uses num_threads host threads, or one per processor for 0. Throws as load_map() does.
std::vector<std::shared_ptr<const RoadMap>> load_maps(const std::vector<std::string>& names, int num_threads = 0);

/// Throws as load_map() does. Also throws UsageError for copies and Lanelet2 files, which have no OpenDRIVE text.
MapText map_text(const std::string& name);

/// Returns the size of a map's file, for estimates of memory. For procedural towns, it is the size of a comparable
/// CARLA file. Throws UsageError for an unknown name.
int64_t map_file_bytes(const std::string& name);

/// Whether the name is that of a .xodr or .osm file, or of a copy of one.
bool is_map_file(std::string_view name);

/// Returns $PICTURA_DATA, else $XDG_DATA_HOME/pictura/maps, else ~/.local/share/pictura/maps. The subfolder `carla` may
/// also contain towns.
std::string map_folder();

/// Returns the towns in the map folder, sorted.
std::vector<std::string> known_towns();

}  // namespace pictura
