// Roads that end: on maps from which no route goes on for ever, where routes end, and where traffic leaves and enters.
#pragma once

#include <cstdint>
#include <vector>

#include "pictura/map/road_map.h"

namespace pictura {

/// A lane is open if at least so much way lies ahead of its start.
constexpr float kMinOpenWay_m = 20.0f;

/// Whether a route goes on for ever from some lane outside junctions. Agents then drive on such lanes alone, and all
/// others count for nothing.
bool has_endless_roads(const RoadMap& map);

/// A line across the end of a lane, where traffic leaves the map, or across its start, where traffic enters.
struct LaneMouth {
  int32_t lane = -1;
  Vec3 middle_m;
  Vec2 direction;  // of traffic, unit vector
  float half_width_m = 0;
};

/// How the driving and ramp lanes of a map end.
struct OpenLanes {
  // [lanes] The longest way of a route on from the end of the lane, or of one beside it; 0: routes end with the lane;
  // infinite on endless lanes, and on lanes of other types.
  std::vector<float> way_after_m;
  std::vector<LaneMouth> exits;    // of lanes with which routes end, but for missing links
  std::vector<LaneMouth> entries;  // of open lanes that no lane leads to, nor to one beside them

  /// The end of a lane with which routes end, within 1 m of the start of another lane: the link is missing.
  struct MissingLink {
    int32_t from = -1, to = -1;
    float gap_m = 0;
  };
  std::vector<MissingLink> missing_links;
};
OpenLanes find_open_lanes(const RoadMap& map);

/// Whether at least kMinOpenWay_m of way lie ahead of the lane's start, and no route goes on for ever.
bool is_open(const RoadMap& map, const OpenLanes& open, std::size_t lane);

/// Removes road edges across exits and entries, so that traffic can pass there.
void open_mouths(const OpenLanes& open, RoadMap* map);

/// Driving and ramp lanes by what agents do on them.
struct LaneUse {
  int32_t endless = 0;      // routes go on for ever
  int32_t open = 0;         // on maps without endless roads: open lanes and those that follow them
  int32_t unreachable = 0;  // all others: no agent is sent there
};
LaneUse count_lane_use(const RoadMap& map);

}  // namespace pictura
