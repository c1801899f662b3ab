// What a map says beyond its surfaces and paint, from above: which way lanes run, lights with the angle within which
// they are seen, signs, building lines, and names where there is room. Private to the drawing library.
#pragma once

#include "pictura/drawing/map_layers.h"

namespace pictura {

constexpr Rgb kBuildingLineInk = hex(0x8A5A3C);
constexpr Rgb kSignInk = hex(0xD6247F);

/// Paints over MapLayers what concerns places on the canvas alone. Arrows, numbers of lanes and names of lights and
/// signs appear as the scale allows; the numbers are those of `pictura map --json --full`.
void paint_details(const RoadMap& map, Canvas& canvas, Vec2 left_top_m, double px_per_m);

/// A sign's diamond, `radius` in units of the canvas.
void sign_path(cairo_t* context, double x, double y, double radius);

}  // namespace pictura
