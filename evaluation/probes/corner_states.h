// States in which an ego nears a blind corner: one from which a vehicle comes that walls hide from it, and ones like it
// where nobody comes. Without torch headers.
#pragma once

#include <map>
#include <vector>

#include "pictura/common/raster/camera.h"
#include "pictura/map/line_of_sight.h"
#include "pictura/map/road_map.h"

namespace pictura {

struct ProbeFrame;

/// A lane into a junction without traffic lights, and lanes whose traffic crosses its own and is hidden from it by
/// walls (find_blind_crossings()). Where lights stop one of the two, nobody need look out for the other.
struct BlindCorner {
  int32_t junction = -1;
  Vec3 entry_m;  // where the lane ends
  // Lanes of hidden traffic, up to kCornerLead_m before the junction, each with where it enters that.
  std::map<int32_t, Vec3> lanes;
};
constexpr float kCornerLead_m = 60;
/// By the lanes that lead there, up to kCornerLead_m before the junction.
using BlindCorners = std::map<int32_t, BlindCorner>;
BlindCorners find_blind_corners(const RoadMap& map, Span<const WallFace> walls);

/// Which states are looked for.
struct CornerSearch {
  float min_distance_m = 8, max_distance_m = 25;  // of the ego's reference point from the corner's entry
  float min_speed_mps = 2;                        // of the ego, and of who is hidden
  float user_range_m = 50;                        // who comes is at most so far from where it enters the junction
};

/// An ego before a blind corner. Agents are numbered in their world.
struct CornerState {
  int32_t scene = 0, map = 0, driver = 0;  // the number of its scenario; indices of its map and of who drove
  int32_t step = 0;                        // steps done in the scenario
  int32_t ego = 0, approach = -1;          // the lane that it is on
  int32_t user = -1;                       // who comes hidden; -1: nobody comes
  float distance_m = 0, speed_mps = 0;     // of the ego from the entry
  View view;                               // of the ego; its indices are those of its frame
};

/// Of a world of a frame. Somebody comes hidden: of the vehicles that drive on the corner's hidden lanes, in range, the
/// nearest one whom walls hide from the ego's front camera, `front`. Nobody comes: no vehicle or cyclist is on these
/// lanes in range, or in the junction.
std::vector<CornerState> find_corner_states(const ProbeFrame& frame, size_t world, const RoadMap& map,
                                            const BlindCorners& corners, const LineOfSight& line_of_sight,
                                            const PinholeCamera& front, const CornerSearch& search);

struct CornerPair {
  CornerState hidden, empty;
};
/// States are alike within so much.
constexpr float kSameDistance_m = 1, kSameSpeed_mps = 0.5f;
/// At most `count` pairs of like states of different egos or scenes, from all scenes in turn. Of an ego that nears one
/// user the first state is taken, and of an ego that nears an empty corner one state: the likest. In order of the
/// hidden states.
std::vector<CornerPair> match_corners(const std::vector<CornerState>& hidden, const std::vector<CornerState>& empty,
                                      int64_t count);

}  // namespace pictura
