// Recorded road users from above. Private to the drawing library.
#pragma once

#include "pictura/drawing/map_layers.h"
#include "pictura/map/scenario/scenario.h"

namespace pictura {

constexpr Rgb kSdcInk = hex(0x0B6E4F), kUnknownTrackInk = hex(0x6B7178);

Rgb track_color(TrackType type);

/// Paints the stop lines of recorded lights, and tracks as lines that are interrupted at gaps.
void paint_paths(const Scenario& scenario, Canvas& canvas, const Eigen::Vector2d& left_top_m, double px_per_m);

/// Paints the boxes of tracks that are valid at a step.
void paint_boxes(const Scenario& scenario, int32_t step, Canvas& canvas, const Eigen::Vector2d& left_top_m,
                 double px_per_m);

}  // namespace pictura
