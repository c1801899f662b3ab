// Derives from the lane graph inherited speed limits and lanes with unbounded routes.
#include <map>

#include "pictura/map/opendrive/build.h"
#include "pictura/map/speed_limit.h"

namespace pictura::opendrive {

void set_speed_limits(Build* build) {
  RoadMap& map = *build->map;
  for (Lane& lane : map.lanes) {
    const FileRoad& road = build->network.roads[static_cast<std::size_t>(lane.source_road)];
    const auto [section, file_lane] = build->file_lanes[static_cast<std::size_t>(&lane - map.lanes.data())];
    // Sections are cut where a limit changes, so the limit at the middle applies throughout. The lane's own limit has
    // precedence.
    const double middle = 0.5 * (section->s + section->end);
    const double own_mps = file_lane->speed_limit_mps.value(middle - section->s);
    lane.speed_limit_mps = static_cast<float>(own_mps > 0 ? own_mps : road.speed_limit_mps.value(middle));
  }
  // Lanes without a limit, such as those of junctions, inherit the highest limit of their predecessors, else of their
  // successors, across any number of lanes.
  auto inherit = [&](IndexRange Lane::* onward) {
    std::vector<int32_t> frontier;
    for (std::size_t i = 0; i < map.lanes.size(); ++i) {
      if (map.lanes[i].speed_limit_mps > 0) frontier.push_back(static_cast<int32_t>(i));
    }
    while (!frontier.empty()) {
      std::map<int32_t, float> inherited;
      for (const int32_t from : frontier) {
        const Lane& lane = map.lanes[static_cast<std::size_t>(from)];
        for (const int32_t to : map.links(lane.*onward)) {
          if (map.lanes[static_cast<std::size_t>(to)].speed_limit_mps > 0) continue;
          float& limit = inherited[to];
          limit = max_of(limit, lane.speed_limit_mps);
        }
      }
      frontier.clear();
      for (const auto& [lane, limit] : inherited) {
        map.lanes[static_cast<std::size_t>(lane)].speed_limit_mps = limit;
        frontier.push_back(lane);
      }
    }
  };
  inherit(&Lane::successors);
  inherit(&Lane::predecessors);
  for (Lane& lane : map.lanes) {
    if (lane.speed_limit_mps <= 0) lane.speed_limit_mps = kDefaultSpeedLimit_mps;
  }
}

void find_endless_lanes(Build* build) {
  RoadMap& map = *build->map;
  // Lanes connected by lane changes form a group, named by its leftmost lane. A group without successor groups is a
  // dead end; dead ends are removed repeatedly, since this may leave their predecessors without successors.
  std::vector<std::size_t> group(map.lanes.size());
  std::vector<std::vector<std::size_t>> members(map.lanes.size());
  for (std::size_t i = 0; i < map.lanes.size(); ++i) {
    std::size_t leftmost = i;
    while (map.lanes[leftmost].left_neighbor >= 0)
      leftmost = static_cast<std::size_t>(map.lanes[leftmost].left_neighbor);
    group[i] = leftmost;
    members[leftmost].push_back(i);
  }
  auto is_route_lane = [&](int32_t lane) { return is_route(map.lanes[static_cast<std::size_t>(lane)].type); };
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
        const std::size_t other = group[static_cast<std::size_t>(before)];
        if (--num_exits[other] == 0) dead_ends.push_back(other);
      }
    }
  }
  for (std::size_t i = 0; i < map.lanes.size(); ++i) {
    map.lanes[i].is_endless = is_route(map.lanes[i].type) && num_exits[group[i]] > 0;
  }
}

}  // namespace pictura::opendrive
