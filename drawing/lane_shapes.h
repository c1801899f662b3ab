// Outlines and drawing order of lanes.
#pragma once

#include <vector>

#include "pictura/map/road_map.h"

namespace pictura {

/// Returns the lane indices, bottom first. Higher levels cover lower ones. Within a level, driving lanes cover the
/// lanes that they cross.
std::vector<int32_t> lanes_in_drawing_order(const RoadMap& map);

/// Returns the ring of the left border forwards, then the right border backwards.
std::vector<Vec2> outline_of(const RoadMap& map, const Lane& lane);

}  // namespace pictura
