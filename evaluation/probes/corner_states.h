// States in which an ego approaches a blind corner: states in which a vehicle hidden by walls comes, and similar states
// in which no vehicle comes. Has no torch headers.
#pragma once

#include <map>
#include <vector>

#include "pictura/common/raster/camera.h"
#include "pictura/map/line_of_sight.h"
#include "pictura/map/road_map.h"

namespace pictura {

struct ProbeFrame;

/// Lane into a junction without traffic lights, and the lanes whose traffic crosses its path and is hidden from it by
/// walls (find_blind_crossings()). Junctions with lights are excluded, since a light stops one of the two streams of
/// traffic.
struct BlindCorner {
  int32_t junction = -1;
  Vec3 entry_m;  // end of the lane
  // Lanes of hidden traffic up to kCornerLead_m before the junction. Each lane is mapped to the place at which its
  // traffic enters the junction.
  std::map<int32_t, Vec3> lanes;
};
constexpr float kCornerLead_m = 60;
/// Blind corners by lane: every lane within kCornerLead_m before the junction that leads to a corner has an entry.
using BlindCorners = std::map<int32_t, BlindCorner>;
BlindCorners find_blind_corners(const RoadMap& map, Span<const WallFace> walls);

/// Criteria of the states to find.
struct CornerSearch {
  float min_distance_m = 8, max_distance_m = 25;  // from the ego's reference point to the corner's entry
  float min_speed_mps = 2;                        // minimum speed of the ego and of the hidden vehicle
  float user_range_m = 50;  // maximum distance of the hidden vehicle from its entry into the junction
};

/// State of an ego before a blind corner. Agents are numbered in their world.
struct CornerState {
  int32_t scene = 0, map = 0, driver = 0;  // number of its scenario; indices of its map and driver
  int32_t step = 0;                        // steps done in the scenario
  int32_t ego = 0, approach = -1;          // approach: the ego's lane
  int32_t user = -1;                       // hidden vehicle; -1: none comes
  float distance_m = 0, speed_mps = 0;     // distance of the ego from the entry, and its speed
  View view;                               // view of the ego, with the indices of its frame
};

/// Finds the states in one world of a frame. A state has a hidden vehicle if walls hide, from the ego's front camera
/// `front`, a vehicle that drives in range on the corner's hidden lanes; the nearest such vehicle is used. A state is
/// empty if no vehicle or cyclist is in range on these lanes, or in the junction.
std::vector<CornerState> find_corner_states(const ProbeFrame& frame, size_t world, const RoadMap& map,
                                            const BlindCorners& corners, const LineOfSight& line_of_sight,
                                            const PinholeCamera& front, const CornerSearch& search);

struct CornerPair {
  CornerState hidden, empty;
};
/// Tolerances within which two states are similar.
constexpr float kSameDistance_m = 1, kSameSpeed_mps = 0.5f;
/// Returns at most `count` pairs of similar states of different egos or scenes, from all scenes in turn, in the order
/// of the hidden states. Of the states in which an ego approaches one hidden vehicle, only the first is used. Of the
/// states in which an ego approaches an empty corner, only the most similar one is used.
std::vector<CornerPair> match_corners(const std::vector<CornerState>& hidden, const std::vector<CornerState>& empty,
                                      int64_t count);

}  // namespace pictura
