// Counts how often walls hide crossing traffic from a driver that approaches a junction. Studies of occlusion compare
// maps by these counts.
#pragma once

#include <vector>

#include "pictura/common/scene_types.h"
#include "pictura/map/road_map.h"

namespace pictura {

/// Counts of blind approaches of a map. A driver and another vehicle approach a junction on different roads, and their
/// paths cross inside the junction. Both are at the same distance before the junction, measured along their lanes. The
/// vehicle is hidden if walls block every tested line of sight from the driver's eye to the vehicle's box.
struct BlindApproaches {
  int32_t approaches = 0;  // lanes that lead into a path that another path crosses
  int32_t blind = 0;       // approaches on which at least one crossing vehicle is hidden
  int32_t crossings = 0;   // ordered pairs (driver, vehicle) of crossing paths
  int32_t hidden = 0;      // crossings whose vehicle is hidden
};

/// Counts blind approaches, with driver and vehicle `distance_m` before the junction. Skips a pair if the lanes before
/// the junction are too short for this distance. The map must be validated.
BlindApproaches count_blind_approaches(const RoadMap& map, Span<const WallFace> walls, float distance_m = 20.0f);

/// Two lanes that lead into a junction. Walls hide traffic on `other_approach` from drivers on `approach`.
struct BlindCrossing {
  int32_t approach = -1, other_approach = -1;
};
/// Returns each pair of lanes with hidden traffic once, in ascending order of lane indices.
std::vector<BlindCrossing> find_blind_crossings(const RoadMap& map, Span<const WallFace> walls,
                                                float distance_m = 20.0f);

}  // namespace pictura
