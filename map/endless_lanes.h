// Finds the lanes on which unbounded routes start.
#pragma once

#include <cstddef>
#include <vector>

#include "pictura/map/road_map.h"

namespace pictura {

constexpr bool is_route(LaneType type) { return type == LaneType::driving || type == LaneType::ramp; }

/// Groups of lanes that lane changes connect.
struct LaneGroups {
  std::vector<std::size_t> of_lane;  // [lanes] leftmost lane of the lane's group
  // [lanes] members[k]: lanes of the group whose leftmost lane is k; empty for other lanes
  std::vector<std::vector<std::size_t>> members;
};
LaneGroups group_lanes(const RoadMap& map);

/// Sets Lane::is_endless of all lanes.
void find_endless_lanes(RoadMap* map);

}  // namespace pictura
