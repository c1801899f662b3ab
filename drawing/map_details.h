// Details over the surfaces and paint in a picture of a map from above: lane directions, lights with the angles within
// which their heads are visible, signs, building lines and names. Private to the drawing library.
#pragma once

#include "pictura/drawing/map_layers.h"

namespace pictura {

constexpr Rgb kBuildingLineInk = hex(0x8A5A3C);
constexpr Rgb kSignInk = hex(0xD6247F);

/// Paints the visible details over MapLayers. Arrows, lane numbers and names of lights and signs are painted only if
/// the scale is large enough. Lane numbers are those of `pictura map --json --full`.
void paint_details(const RoadMap& map, Canvas& canvas, const Eigen::Vector2d& left_top_m, double px_per_m);

/// Appends the diamond of a sign to the path; `radius` is in units of the canvas.
void sign_path(cairo_t* context, double x, double y, double radius);

}  // namespace pictura
