// Details over the surfaces and paint in a map picture: lane directions, lights, signs, building lines and names.
// Private to the drawing library.
#pragma once

#include "pictura/drawing/map_layers.h"

namespace pictura {

constexpr Rgb kBuildingLineInk = hex(0x8A5A3C);
constexpr Rgb kSignInk = hex(0xD6247F);

/// Paints over MapLayers. Arrows, lane numbers (as in `pictura map --json --full`) and names require a large scale.
void paint_details(const RoadMap& map, Canvas& canvas, const Eigen::Vector2d& left_top_m, double px_per_m);

/// Appends a sign's diamond to the path; `radius` is in canvas units.
void sign_path(cairo_t* context, double x, double y, double radius);

}  // namespace pictura
