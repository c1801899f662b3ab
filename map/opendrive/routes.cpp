// Sets speed limits of lanes. Lanes without a limit inherit limits along the lane graph.
#include <map>

#include "pictura/map/opendrive/build.h"
#include "pictura/map/speed_limit.h"

namespace pictura::opendrive {

void set_speed_limits(Build* build) {
  RoadMap& map = *build->map;
  for (Lane& lane : map.lanes) {
    const FileRoad& road = build->network.roads[lane.source_road];
    const auto [section, file_lane] = build->file_lanes[&lane - map.lanes.data()];
    // The limit at the middle applies to the whole section, because sections are cut where a limit changes. The lane's
    // own limit has precedence over the road's.
    const double middle = 0.5 * (section->s + section->end);
    const double own_mps = file_lane->speed_limit_mps.value(middle - section->s);
    lane.speed_limit_mps = static_cast<float>(own_mps > 0 ? own_mps : road.speed_limit_mps.value(middle));
  }
  // Lanes without a limit, such as junction lanes, inherit the highest limit of their predecessors, across any number
  // of lanes. If no predecessor has a limit, they inherit from successors in the same way.
  auto inherit = [&](IndexRange Lane::* onward) {
    std::vector<int32_t> frontier;
    for (std::size_t i = 0; i < map.lanes.size(); ++i) {
      if (map.lanes[i].speed_limit_mps > 0) frontier.push_back(static_cast<int32_t>(i));
    }
    while (!frontier.empty()) {
      std::map<int32_t, float> inherited;
      for (const int32_t from : frontier) {
        const Lane& lane = map.lanes[from];
        for (const int32_t to : map.links(lane.*onward)) {
          if (map.lanes[to].speed_limit_mps > 0) continue;
          float& limit = inherited[to];
          limit = max_of(limit, lane.speed_limit_mps);
        }
      }
      frontier.clear();
      for (const auto& [lane, limit] : inherited) {
        map.lanes[lane].speed_limit_mps = limit;
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

}  // namespace pictura::opendrive
