// Importer of Lanelet2 (.osm) files.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "pictura/common/error_types.h"
#include "pictura/map/lanelet2/projection.h"
#include "pictura/map/opendrive/opendrive.h"
#include "pictura/map/road_map.h"

namespace pictura {

/// Parses a Lanelet2 file; repairs and throws as parse_opendrive() does. File coordinates are those of place_nodes().
/// Unlike in parse_opendrive(), options.plan also stretches the widths of lanes. docs/reference/lanelet2.md lists the
/// elements that are read.
RoadMap parse_lanelet2(std::string_view text, const std::string& source, const OpenDriveOptions& options = {},
                       const std::optional<GeoPoint>& origin = std::nullopt, const ImportProgress& progress = {});

}  // namespace pictura
