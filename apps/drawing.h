// A map from above, for people.
#pragma once

#include <string>

#include "pictura/map/road_map.h"

namespace pictura {

/// Draws lanes by type, markings, road edges, lights with their stop lines, crosswalks and a scale bar, and writes a
/// PNG whose longer side is size_px (beside, then renamed). Throws Error naming the path.
void draw_map_png(const RoadMap& map, const std::string& path, int size_px = 1600);

}  // namespace pictura
