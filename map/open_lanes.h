// Roads that end, on maps without endless routes: finds where routes end, and where traffic leaves and enters the map.
#pragma once

#include <cstdint>
#include <vector>

#include "pictura/map/road_map.h"

namespace pictura {

/// A lane is open only if the longest route from its start has at least this length.
constexpr float kMinOpenWay_m = 20.0f;

/// Whether an endless route starts on any lane outside junctions. If so, agents drive only on endless lanes.
bool has_endless_roads(const RoadMap& map);

/// A line across the end of a lane, where traffic leaves the map, or across its start, where traffic enters.
struct LaneOpening {
  int32_t lane = -1;
  Vec3 middle_m;
  Vec2 direction;  // direction of traffic, unit vector
  float half_width_m = 0;
};

/// Ends of a map's driving and ramp lanes.
struct OpenLanes {
  // [lanes] Length of the longest route that continues after the end of the lane or of a lane beside it. 0 if routes
  // end with the lane. Infinite for endless lanes, and for lanes that are neither driving nor ramp lanes.
  std::vector<float> way_after_m;
  std::vector<LaneOpening> exits;  // at the ends of lanes where routes end, except at missing links
  // At the starts of open lanes, if neither the lane nor a lane beside it has predecessors.
  std::vector<LaneOpening> entries;

  /// A missing link: routes end with lane `from`, but lane `to` starts within 1 m of its end.
  struct MissingLink {
    int32_t from = -1, to = -1;
    float gap_m = 0;
  };
  std::vector<MissingLink> missing_links;
};
OpenLanes find_open_lanes(const RoadMap& map);

/// Whether a driving or ramp lane is open: the longest route from its start is finite and at least kMinOpenWay_m long.
bool is_open(const RoadMap& map, const OpenLanes& open, std::size_t lane);

/// Removes the parts of road edges that cross exits and entries, so that traffic can pass there.
void remove_edges_across_openings(const OpenLanes& open, RoadMap* map);

/// Numbers of driving and ramp lanes by their use.
struct LaneUse {
  int32_t endless = 0;      // lanes on which an endless route starts
  int32_t open = 0;         // on maps without endless roads: open lanes and the lanes that follow them
  int32_t unreachable = 0;  // all other lanes: agents are never sent there
};
LaneUse count_lane_use(const RoadMap& map);

}  // namespace pictura
