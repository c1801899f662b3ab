// Finds where routes end, and where traffic leaves and enters a map without endless routes.
#pragma once

#include <cstdint>
#include <vector>

#include "pictura/map/road_map.h"

namespace pictura {

/// Minimum length of the longest route from the start of an open lane.
constexpr float kMinOpenWay_m = 20.0f;

/// Whether an endless route starts on any lane outside junctions. If so, agents use only endless lanes.
bool has_endless_roads(const RoadMap& map);

/// A line across the end of a lane, where traffic leaves, or across its start, where traffic enters.
struct LaneOpening {
  int32_t lane = -1;
  Vec3 middle_m;
  Vec2 direction;  // unit vector in the direction of traffic
  float half_width_m = 0;
};

/// Ends of routes on a map's lanes.
struct OpenLanes {
  // [lanes] Length of the longest route that begins at the end of this lane or at the end of a lane beside it. Infinite
  // for endless lanes and for lanes where is_route() is false.
  std::vector<float> way_after_m;
  std::vector<LaneOpening> exits;  // at the ends of routes, except at missing links
  // At the starts of open lanes, if neither the lane nor a lane beside it has predecessors.
  std::vector<LaneOpening> entries;

  /// Routes end with lane `from`, but lane `to` starts within 1 m of its end.
  struct MissingLink {
    int32_t from = -1, to = -1;
    float gap_m = 0;
  };
  std::vector<MissingLink> missing_links;
};
OpenLanes find_open_lanes(const RoadMap& map);

/// Whether the lane is a driving or ramp lane, and its longest route is finite and at least kMinOpenWay_m long.
bool is_open(const RoadMap& map, const OpenLanes& open, std::size_t lane);

/// Removes the parts of road edges across exits and entries.
void remove_edges_across_openings(const OpenLanes& open, RoadMap* map);

/// Numbers of driving and ramp lanes.
struct LaneUse {
  int32_t endless = 0;
  int32_t open = 0;         // open lanes and the lanes that they lead to; 0 on maps with endless roads
  int32_t unreachable = 0;  // other lanes, which agents never use
};
LaneUse count_lane_use(const RoadMap& map);

}  // namespace pictura
