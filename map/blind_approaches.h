// Counts how often walls hide crossing traffic from a driver that approaches a junction.
#pragma once

#include <vector>

#include "pictura/common/scene_types.h"
#include "pictura/map/road_map.h"

namespace pictura {

/// Counts of blind approaches. A driver and a vehicle approach a junction on different roads, at equal distance. Their
/// paths cross in the junction. The vehicle is hidden if walls block every tested line of sight to its box.
struct BlindApproaches {
  int32_t approaches = 0;  // lanes that lead to a path that crosses another path in a junction
  int32_t blind = 0;       // approaches with at least one hidden vehicle
  int32_t crossings = 0;   // ordered pairs of crossing paths
  int32_t hidden = 0;      // crossings with a hidden vehicle
};

/// Skips a pair if its lanes before the junction are shorter than `distance_m`. The map must be validated.
BlindApproaches count_blind_approaches(const RoadMap& map, Span<const WallFace> walls, float distance_m = 20.0f);

/// Walls hide traffic on `other_approach` from drivers on `approach`.
struct BlindCrossing {
  int32_t approach = -1, other_approach = -1;
};
/// Returns each pair of lanes once, in ascending order.
std::vector<BlindCrossing> find_blind_crossings(const RoadMap& map, Span<const WallFace> walls,
                                                float distance_m = 20.0f);

}  // namespace pictura
