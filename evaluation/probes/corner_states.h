// Search for states in which an ego (the vehicle that policies take over) approaches a blind corner.
#pragma once

#include <map>
#include <vector>

#include "pictura/common/raster/camera.h"
#include "pictura/map/line_of_sight.h"
#include "pictura/map/road_map.h"

namespace pictura {

struct ProbeFrame;

/// Blind corner: an approach lane into a junction, and lanes of crossing traffic that walls hide from it
/// (find_blind_crossings()). Junctions with lights are excluded, because a light stops one stream of traffic.
struct BlindCorner {
  int32_t junction = -1;
  Vec3 entry_m;  // end of the approach lane
  // Lanes of hidden traffic up to kCornerLead_m before the junction, with the places where they enter it.
  std::map<int32_t, Vec3> lanes;
};
constexpr float kCornerLead_m = 60;
/// Blind corners by approaching lane. Keys are the approach lane and the lanes that lead to it, up to kCornerLead_m
/// before the junction.
using BlindCorners = std::map<int32_t, BlindCorner>;
BlindCorners find_blind_corners(const RoadMap& map, Span<const WallFace> walls);

struct CornerSearch {
  float min_distance_m = 8, max_distance_m = 25;  // from the ego's reference point to the corner's entry
  float min_speed_mps = 2;                        // for the ego and the hidden vehicle
  float user_range_m = 50;                        // from the hidden vehicle to its entry
};

/// State of an ego before a blind corner. Agent indices are within their world.
struct CornerState {
  int32_t scene = 0, map = 0, driver = 0;  // scene: scenario number; map, driver: indices
  int32_t step = 0;                        // completed steps
  int32_t ego = 0, approach = -1;          // approach: the ego's lane
  int32_t user = -1;                       // hidden vehicle; -1: none comes
  float distance_m = 0, speed_mps = 0;     // the ego's distance from the corner's entry, and its speed
  View view;                               // the ego's view in the searched frame
};

/// Finds the states in one world of a frame. A hidden vehicle is in range on a lane of hidden traffic, and walls hide
/// it from the ego's `front` camera. The nearest one is used. In an empty state, these lanes have no vehicle or cyclist
/// in range, and the junction has none.
std::vector<CornerState> find_corner_states(const ProbeFrame& frame, size_t world, const RoadMap& map,
                                            const BlindCorners& corners, const LineOfSight& line_of_sight,
                                            const PinholeCamera& front, const CornerSearch& search);

struct CornerPair {
  CornerState hidden, empty;
};
/// Tolerances of similar states.
constexpr float kSameDistance_m = 1, kSameSpeed_mps = 0.5f;
/// Returns at most `count` pairs of similar states, ordered by hidden state. The two states of a pair have different
/// egos or scenes. Takes pairs from all scenes in turn. Of the hidden states with the same ego and hidden vehicle, uses
/// only the first. An ego's approach to an empty corner is in at most one pair. Of its states, the one most similar to
/// the hidden state is taken.
std::vector<CornerPair> match_corners(const std::vector<CornerState>& hidden, const std::vector<CornerState>& empty,
                                      int64_t count);

}  // namespace pictura
