// Lanes where an unbounded route starts, whatever the importer.
#pragma once

#include <cstddef>
#include <vector>

#include "pictura/map/road_map.h"

namespace pictura {

/// Lane types of which routes are made.
constexpr bool is_route(LaneType type) { return type == LaneType::driving || type == LaneType::ramp; }

/// Lanes connected by lane changes form a group, named by its leftmost lane.
struct LaneGroups {
  std::vector<std::size_t> of_lane;               // [lanes] the leftmost lane of its group
  std::vector<std::vector<std::size_t>> members;  // [lanes] the group of that name; empty where there is none
};
LaneGroups group_lanes(const RoadMap& map);

/// Sets Lane::is_endless of all lanes from links, neighbours and types.
void find_endless_lanes(RoadMap* map);

}  // namespace pictura
