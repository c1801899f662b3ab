// Lanes from above as shapes, without a canvas: their outlines, and the order in which they cover each other.
#pragma once

#include <vector>

#include "pictura/map/road_map.h"

namespace pictura {

/// Indices of all lanes, those below first: higher storeys cover lower ones, so that bridges are drawn above the road
/// that they cross, and on a storey driving lanes cover what they cross.
std::vector<int32_t> lanes_in_drawing_order(const RoadMap& map);

/// The ring around a lane: its left border in the direction of travel, then its right border backwards.
std::vector<Vec2> outline_of(const RoadMap& map, const Lane& lane);

}  // namespace pictura
