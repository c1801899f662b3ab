// Outline of a surface that consists of overlapping bands (lanes), computed separately for each level of height.
#pragma once

#include <vector>

#include "pictura/map/road_map.h"
#include "pictura/map/surface.h"

namespace pictura {

/// Returns the outline of the union of the bands, as pieces of at most kMaxPiece_m with the surface on their right,
/// each within `chord_error_m` of the exact outline. Surfaces at least 2 m apart in height do not touch. Gaps of up to
/// 5 cm between bands count as closed, and outlines shorter than 0.3 m in total are dropped. If `bands_out` is not
/// null, it receives, for each piece, the index of the band on which the piece begins.
std::vector<RoadEdge> outline_of(const std::vector<SurfaceBand>& bands, double chord_error_m,
                                 std::vector<int32_t>* bands_out = nullptr);

}  // namespace pictura
