// Painting of recorded road users from above: their paths, and their boxes at one step. Private to the drawing library.
#pragma once

#include "pictura/drawing/map_layers.h"
#include "pictura/map/scenario/scenario.h"

namespace pictura {

constexpr Rgb kSdcInk = hex(0x0B6E4F), kUnknownTrackInk = hex(0x6B7178);

/// Colour of a track of this type.
Rgb track_color(TrackType type);

/// Paints the stop lines of recorded lights, and every track as a line through its valid states, interrupted at gaps.
void paint_paths(const Scenario& scenario, Canvas& canvas, const Eigen::Vector2d& left_top_m, double px_per_m);

/// Paints the boxes of all tracks whose state is valid at a step of the scenario.
void paint_boxes(const Scenario& scenario, int32_t step, Canvas& canvas, const Eigen::Vector2d& left_top_m,
                 double px_per_m);

}  // namespace pictura
