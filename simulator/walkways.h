// Walkways of pedestrians: straight pieces of the centre lines of crosswalks and sidewalks (shoulders on maps without
// sidewalks), in both directions.
#pragma once

#include <vector>

#include "pictura/map/road_map.h"
#include "pictura/simulator/rules/map_view.h"

namespace pictura {

struct Walkways {
  std::vector<WalkPiece> pieces;     // in pairs, one per direction
  std::vector<float> end_m;          // [pieces] running sum of lengths
  std::vector<int32_t> leave_begin;  // [nodes + 1] into `leaving`
  std::vector<int32_t> leaving;      // pieces that leave each node
};

/// Makes a map's walkways. Omits pieces on the drivable surface of `roads` (except crosswalks), and connected networks
/// shorter than kMinWalk_m. Reads only the lanes and cells of `roads`.
Walkways make_walkways(const RoadMap& map, const MapView& roads);

constexpr float kMinWalk_m = 40.0f;

}  // namespace pictura
