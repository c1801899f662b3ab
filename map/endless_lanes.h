// Lanes where an unbounded route starts, whatever the importer.
#pragma once

#include "pictura/map/road_map.h"

namespace pictura {

/// Lane types of which routes are made.
constexpr bool is_route(LaneType type) { return type == LaneType::driving || type == LaneType::ramp; }

/// Sets Lane::is_endless of all lanes from links, neighbours and types.
void find_endless_lanes(RoadMap* map);

}  // namespace pictura
