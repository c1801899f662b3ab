// How often walls hide crossing traffic from drivers who approach a junction: a property of maps that occlusion studies
// need.
#pragma once

#include <vector>

#include "pictura/common/scene_types.h"
#include "pictura/map/road_map.h"

namespace pictura {

/// The eye is `distance_m` before a junction; a crossing vehicle is as far before it on another road, and their paths
/// cross inside the junction. The vehicle is hidden if walls block every line of sight from the eye to its box.
/// Distances are measured along the lanes that lead to the junction.
struct BlindApproaches {
  int32_t approaches = 0;  // lanes into a junction from which some path is crossed by another path
  int32_t blind = 0;       // of these, with a hidden crossing vehicle
  int32_t crossings = 0;   // ordered pairs of crossing paths that come from different roads
  int32_t hidden = 0;      // of these, with a hidden crossing vehicle
};

/// Paths whose lanes begin closer to the junction are left out. The map must be validated.
BlindApproaches count_blind_approaches(const RoadMap& map, Span<const WallFace> walls, float distance_m = 20.0f);

/// A lane into a junction, and one from whose traffic walls hide it: lanes of a hidden pair.
struct BlindCrossing {
  int32_t approach = -1, other_approach = -1;
};
/// Each once, in ascending order.
std::vector<BlindCrossing> find_blind_crossings(const RoadMap& map, Span<const WallFace> walls,
                                                float distance_m = 20.0f);

}  // namespace pictura
