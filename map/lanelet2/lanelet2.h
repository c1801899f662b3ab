// Imports Lanelet2 (.osm) files as RoadMaps.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "pictura/common/error_types.h"
#include "pictura/map/lanelet2/projection.h"
#include "pictura/map/opendrive/opendrive.h"
#include "pictura/map/road_map.h"

namespace pictura {

/// Parses the text of a Lanelet2 file. `source` is the file's name in messages. The file coordinates are those of the
/// tags local_x and local_y if the file has them, else UTM coordinates in metres. With `origin`, they are UTM
/// coordinates minus those of the origin. Faults that have only one sensible meaning are repaired and recorded in
/// `RoadMap::mends`. For all other faults, and for any fault if options.strict is set, throws Error naming source, line
/// and element. In an affine copy (options.plan), widths of lanes are stretched too. docs/reference/lanelet2.md lists
/// the elements that are read.
RoadMap parse_lanelet2(std::string_view text, const std::string& source, const OpenDriveOptions& options = {},
                       const std::optional<GeoPoint>& origin = std::nullopt, const ImportProgress& progress = {});

}  // namespace pictura
