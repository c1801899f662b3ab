// Outline of a surface of overlapping bands (lanes).
#pragma once

#include <vector>

#include "pictura/map/road_map.h"
#include "pictura/map/surface.h"

namespace pictura {

/// Returns the outline in pieces of at most kMaxPiece_m, with the surface on their right. It is within `chord_error_m`
/// of the exact outline. Surfaces at least 2 m apart in height do not touch. Gaps of up to 5 cm are closed, and
/// outlines shorter than 0.3 m are dropped. `bands_out` receives the band of each piece's start.
std::vector<RoadEdge> outline_of(const std::vector<SurfaceBand>& bands, double chord_error_m,
                                 std::vector<int32_t>* bands_out = nullptr);

}  // namespace pictura
