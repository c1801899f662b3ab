// Frequency with which walls hide crossing traffic from drivers who approach a junction: a property of maps for studies
// of occlusion.
#pragma once

#include <vector>

#include "pictura/common/scene_types.h"
#include "pictura/map/road_map.h"

namespace pictura {

/// Counts of blind approaches. The eye is `distance_m` before a junction. A crossing vehicle is equally far before the
/// junction on another road, and their paths cross inside the junction. The vehicle is hidden if walls block every line
/// of sight from the eye to its box. Distances are measured along the lanes that lead to the junction.
struct BlindApproaches {
  int32_t approaches = 0;  // lanes into a junction with a path that another path crosses
  int32_t blind = 0;       // approaches with a hidden crossing vehicle
  int32_t crossings = 0;   // ordered pairs of crossing paths from different roads
  int32_t hidden = 0;      // crossings with a hidden crossing vehicle
};

/// Counts blind approaches at `distance_m` before junctions. Paths whose lanes begin closer to the junction are
/// skipped. The map must be validated.
BlindApproaches count_blind_approaches(const RoadMap& map, Span<const WallFace> walls, float distance_m = 20.0f);

/// A hidden pair: a lane into a junction, and a lane whose traffic is hidden from it by walls.
struct BlindCrossing {
  int32_t approach = -1, other_approach = -1;
};
/// Returns each hidden pair of lanes once, in ascending order.
std::vector<BlindCrossing> find_blind_crossings(const RoadMap& map, Span<const WallFace> walls,
                                                float distance_m = 20.0f);

}  // namespace pictura
