#include "pictura/map/endless_lanes.h"

namespace pictura {

LaneGroups group_lanes(const RoadMap& map) {
  LaneGroups groups{std::vector<std::size_t>(map.lanes.size()),
                    std::vector<std::vector<std::size_t>>(map.lanes.size())};
  for (std::size_t i = 0; i < map.lanes.size(); ++i) {
    std::size_t leftmost = i;
    while (map.lanes[leftmost].left_neighbor >= 0)
      leftmost = static_cast<std::size_t>(map.lanes[leftmost].left_neighbor);
    groups.of_lane[i] = leftmost;
    groups.members[leftmost].push_back(i);
  }
  return groups;
}

void find_endless_lanes(RoadMap* map_inout) {
  RoadMap& map = *map_inout;
  // A group without successor groups is a dead end. Removing a dead end may turn its predecessors into dead ends, so
  // dead ends are removed repeatedly.
  const LaneGroups groups = group_lanes(map);
  const std::vector<std::size_t>& group = groups.of_lane;
  const std::vector<std::vector<std::size_t>>& members = groups.members;
  auto is_route_lane = [&](int32_t lane) { return is_route(map.lanes[lane].type); };
  std::vector<int> num_exits(map.lanes.size(), 0);
  for (std::size_t i = 0; i < map.lanes.size(); ++i) {
    if (!is_route(map.lanes[i].type)) continue;
    for (const int32_t next : map.links(map.lanes[i].successors)) num_exits[group[i]] += is_route_lane(next) ? 1 : 0;
  }
  std::vector<std::size_t> dead_ends;
  for (std::size_t i = 0; i < map.lanes.size(); ++i) {
    if (group[i] == i && num_exits[i] == 0) dead_ends.push_back(i);
  }
  while (!dead_ends.empty()) {
    const std::size_t dead_end = dead_ends.back();
    dead_ends.pop_back();
    for (const std::size_t lane : members[dead_end]) {
      if (!is_route(map.lanes[lane].type)) continue;
      for (const int32_t before : map.links(map.lanes[lane].predecessors)) {
        if (!is_route_lane(before)) continue;
        const std::size_t other = group[before];
        if (--num_exits[other] == 0) dead_ends.push_back(other);
      }
    }
  }
  for (std::size_t i = 0; i < map.lanes.size(); ++i) {
    map.lanes[i].is_endless = is_route(map.lanes[i].type) && num_exits[group[i]] > 0;
  }
}

}  // namespace pictura
