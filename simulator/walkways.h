// Walkways of pedestrians: the centre lines of sidewalks and crosswalks, as a network of straight pieces. On maps
// without sidewalks, shoulders replace them. Pedestrians walk in both directions.
#pragma once

#include <vector>

#include "pictura/map/road_map.h"
#include "pictura/simulator/rules/map_view.h"

namespace pictura {

struct Walkways {
  std::vector<WalkPiece> pieces;     // in pairs, one per direction
  std::vector<float> end_m;          // [pieces] running sum of the pieces' lengths
  std::vector<int32_t> leave_begin;  // [nodes + 1] into `leaving`
  std::vector<int32_t> leaving;      // pieces that leave each node
};

/// Makes the walkways of a map. Omits pieces on the drivable surface of `roads` (except on crosswalks), and connected
/// networks whose total length is below kMinWalk_m. Only the lanes of `roads` and their cells are read. The result is
/// empty if the map has no walkways.
Walkways make_walkways(const RoadMap& map, const MapView& roads);

constexpr float kMinWalk_m = 40.0f;

}  // namespace pictura
