// Roads that end, on maps without endless routes: where routes end, and where traffic leaves and enters.
#pragma once

#include <cstdint>
#include <vector>

#include "pictura/map/road_map.h"

namespace pictura {

/// Minimum length of route ahead of an open lane's start.
constexpr float kMinOpenWay_m = 20.0f;

/// Whether an endless route starts at some lane outside junctions. Agents then drive only on endless lanes, and all
/// other lanes are ignored.
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
  // [lanes] Length of the longest route that continues after the end of the lane, or after the end of a lane beside it.
  // 0: routes end with the lane. Infinite for endless lanes, and for lanes of other types.
  std::vector<float> way_after_m;
  std::vector<LaneOpening> exits;    // exits of lanes where routes end, except at missing links
  std::vector<LaneOpening> entries;  // entries of open lanes; these and the lanes beside them have no predecessors

  /// A missing link: the end of a lane where routes end, within 1 m of the start of another lane.
  struct MissingLink {
    int32_t from = -1, to = -1;
    float gap_m = 0;
  };
  std::vector<MissingLink> missing_links;
};
OpenLanes find_open_lanes(const RoadMap& map);

/// Whether at least kMinOpenWay_m of way lie ahead of the lane's start on a map without endless routes.
bool is_open(const RoadMap& map, const OpenLanes& open, std::size_t lane);

/// Removes road edges across exits and entries, so that traffic can pass there.
void remove_edges_across_openings(const OpenLanes& open, RoadMap* map);

/// Numbers of driving and ramp lanes by their use.
struct LaneUse {
  int32_t endless = 0;      // start of an endless route
  int32_t open = 0;         // on maps without endless roads: open lanes and the lanes that follow them
  int32_t unreachable = 0;  // all other lanes: agents are never sent there
};
LaneUse count_lane_use(const RoadMap& map);

}  // namespace pictura
