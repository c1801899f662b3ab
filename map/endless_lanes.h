// Finds the lanes on which an unbounded route starts, for all importers.
#pragma once

#include <cstddef>
#include <vector>

#include "pictura/map/road_map.h"

namespace pictura {

/// Whether routes use lanes of this type.
constexpr bool is_route(LaneType type) { return type == LaneType::driving || type == LaneType::ramp; }

/// Groups of lanes that lane changes connect. A group's leftmost lane identifies it.
struct LaneGroups {
  std::vector<std::size_t> of_lane;  // [lanes] leftmost lane of the lane's group
  // [lanes] Members of the group whose leftmost lane is this lane; empty for other lanes.
  std::vector<std::vector<std::size_t>> members;
};
LaneGroups group_lanes(const RoadMap& map);

/// Sets Lane::is_endless of all lanes from links, neighbours and types.
void find_endless_lanes(RoadMap* map);

}  // namespace pictura
