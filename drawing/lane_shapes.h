// Shapes of lanes from above: their outlines, and the order in which they cover each other. Needs no canvas.
#pragma once

#include <vector>

#include "pictura/map/road_map.h"

namespace pictura {

/// Returns the indices of all lanes, bottom first. Higher levels cover lower levels, so that bridges are drawn above
/// the road that they cross. Within a level, driving lanes cover the lanes that they cross.
std::vector<int32_t> lanes_in_drawing_order(const RoadMap& map);

/// Returns the ring around a lane: its left border in the direction of travel, then its right border backwards.
std::vector<Vec2> outline_of(const RoadMap& map, const Lane& lane);

}  // namespace pictura
