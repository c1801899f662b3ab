// How often walls hide crossing traffic from drivers who come to a junction: what occlusion studies need to know of a
// map.
#pragma once

#include "pictura/common/scene_types.h"
#include "pictura/map/road_map.h"

namespace pictura {

/// A driver's eye stands `distance_m` before a junction, a crossing vehicle as far before it on another road, so that
/// their paths through the junction cross. The vehicle is hidden if walls stand in every line of sight from the eye to
/// its box. Distances run along the lanes that lead to the junction.
struct BlindApproaches {
  int32_t approaches = 0;  // lanes that lead into a junction, where some other path crosses one of theirs
  int32_t blind = 0;       // of these, with a crossing vehicle that is hidden
  int32_t crossings = 0;   // pairs of a path and one that crosses it from another road; each pair counts both ways
  int32_t hidden = 0;      // of these, with the crossing vehicle hidden
};

/// Paths whose lanes do not begin so far before the junction are left out. The map must be validated.
BlindApproaches count_blind_approaches(const RoadMap& map, Span<const WallFace> walls, float distance_m = 20.0f);

}  // namespace pictura
