// Statistics of a finished map.
#include <algorithm>

#include "pictura/map/opendrive/build.h"

namespace pictura::opendrive {

void count_facts(Build* build) {
  const Network& network = build->network;
  const RoadMap& map = *build->map;
  MapFacts facts;
  facts.roads = static_cast<int32_t>(network.roads.size());
  facts.junction_roads = static_cast<int32_t>(std::count_if(
      network.roads.begin(), network.roads.end(), [](const FileRoad& road) { return !road.junction.empty(); }));
  facts.junctions = static_cast<int32_t>(map.junctions.size());
  facts.signal_junctions = static_cast<int32_t>(std::count_if(
      map.junctions.begin(), map.junctions.end(), [](const Junction& junction) { return junction.num_phases > 0; }));
  bool first = true;
  for (std::size_t i = 0; i < map.lanes.size(); ++i) {
    const Lane& lane = map.lanes[i];
    const auto [section, file_lane] = build->file_lanes[i];
    // Some lanes are cut where their speed limit changes. The pieces count as one lane, as in the file.
    const bool is_counted = !file_lane->is_continued && lane.length_m >= kShortestLane_m;
    facts.lanes += is_counted;
    if (lane.type != LaneType::driving) continue;
    facts.driving_lanes += is_counted;
    // Measured along the reference line, like s in the file.
    const double length_m = length_between(network.roads[lane.source_road], section->s, section->end);
    facts.driving_lane_km += 1e-3 * length_m;
    if (lane.in_junction) facts.driving_lane_km_in_junctions += 1e-3 * length_m;
    for (const LanePoint& point : map.points_of(lane)) {
      const double z = static_cast<double>(point.position_m.z) + map.origin_m[2];
      facts.z_min_m = first ? z : std::min(facts.z_min_m, z);
      facts.z_max_m = first ? z : std::max(facts.z_max_m, z);
      first = false;
    }
  }
  facts.traffic_lights = static_cast<int32_t>(map.lights.size());
  facts.stop_lines = facts.traffic_lights;
  facts.crosswalks = static_cast<int32_t>(map.crosswalks.size());
  facts.painted_stop_lines = static_cast<int32_t>(map.stop_lines.size());
  facts.signs = static_cast<int32_t>(map.signs.size());
  facts.parking_spaces = static_cast<int32_t>(map.parking_spaces.size());
  build->map->facts = facts;
}

}  // namespace pictura::opendrive
