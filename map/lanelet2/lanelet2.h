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

/// Parses the text of a Lanelet2 file. `source` names it in messages. The map's file coordinates are those of the tags
/// local_x and local_y, else UTM in metres; with `origin` they are UTM minus the origin's. Faults that have one
/// sensible meaning are repaired and recorded in `RoadMap::mends`; throws Error naming source, line and element for all
/// others, and in strict reading for any fault. Copies (options.plan) are stretched with the widths of their lanes.
/// docs/reference/lanelet2.md lists the elements that are read.
RoadMap parse_lanelet2(std::string_view text, const std::string& source, const OpenDriveOptions& options = {},
                       const std::optional<GeoPoint>& origin = std::nullopt, const ImportProgress& progress = {});

}  // namespace pictura
