// Search for states in which an ego (the vehicle that policies take over) approaches a blind corner. In some of the
// states walls hide a vehicle on a crossing lane; in similar states no vehicle comes. Includes no torch headers.
#pragma once

#include <map>
#include <vector>

#include "pictura/common/raster/camera.h"
#include "pictura/map/line_of_sight.h"
#include "pictura/map/road_map.h"

namespace pictura {

struct ProbeFrame;

/// Blind corner: an approach lane into a junction without traffic lights, and lanes of hidden traffic. Hidden traffic
/// crosses the approach lane's path, and walls hide it from that lane (find_blind_crossings()). Junctions with lights
/// are excluded, because a light stops one of the two streams of traffic.
struct BlindCorner {
  int32_t junction = -1;
  Vec3 entry_m;  // end of the approach lane
  // Lanes of hidden traffic up to kCornerLead_m before the junction. Each lane is mapped to the place at which its
  // traffic enters the junction.
  std::map<int32_t, Vec3> lanes;
};
constexpr float kCornerLead_m = 60;
/// Blind corners by the ego's lane. The keys are all lanes that lead to a corner and are at most kCornerLead_m before
/// its junction.
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
  int32_t scene = 0, map = 0, driver = 0;  // number of the scenario; indices of its map and driver
  int32_t step = 0;                        // steps done in the scenario
  int32_t ego = 0, approach = -1;          // approach: the ego's lane
  int32_t user = -1;                       // hidden vehicle; -1: none comes
  float distance_m = 0, speed_mps = 0;     // the ego's distance from the corner's entry, and its speed
  View view;                               // view of the ego; indices in it refer to the frame of the search
};

/// Finds the states in one world of a frame, with or without a hidden vehicle. A hidden vehicle drives in range on a
/// lane of the corner's hidden traffic, and walls hide it from the ego's front camera `front`. If there are several,
/// the nearest is used. A state is empty if no vehicle or cyclist is in range on these lanes, and none is in the
/// junction.
std::vector<CornerState> find_corner_states(const ProbeFrame& frame, size_t world, const RoadMap& map,
                                            const BlindCorners& corners, const LineOfSight& line_of_sight,
                                            const PinholeCamera& front, const CornerSearch& search);

struct CornerPair {
  CornerState hidden, empty;
};
/// Tolerances within which two states are similar.
constexpr float kSameDistance_m = 1, kSameSpeed_mps = 0.5f;
/// Returns at most `count` pairs of similar states. The two states of a pair differ in ego or scene. Pairs are taken
/// from all scenes in turn, and returned in the order of their hidden states. If an ego approaches the same hidden
/// vehicle in several states, only the first of these states is used. If an ego approaches the same empty corner in
/// several states, only the most similar one is used.
std::vector<CornerPair> match_corners(const std::vector<CornerState>& hidden, const std::vector<CornerState>& empty,
                                      int64_t count);

}  // namespace pictura
