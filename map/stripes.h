// Geometry of painted stripes along polylines: parallel lines, parts of lines, and dashes. Shared by the importers.
#pragma once

#include <vector>

#include "pictura/map/polyline.h"

namespace pictura {

/// Dashes of 3 m with gaps of 9 m: the North American pattern, which CARLA's towns imitate.
constexpr double kDash_m = 3.0, kDashPeriod_m = 12.0;

/// Returns the line moved to its left in plan. Corners are mitred; a sharp corner moves by at most twice the offset.
/// The line must have two or more points, none of which equals the point before it.
std::vector<CurvePoint> moved_left(const std::vector<CurvePoint>& line, double offset_m);

/// Returns the part of a line between two arc lengths.
std::vector<CurvePoint> part_of(const std::vector<CurvePoint>& line, double begin_m, double end_m);

double plan_length_m(const std::vector<CurvePoint>& line);

/// Returns at least one dash; the dashes are centred along the line.
std::vector<std::vector<CurvePoint>> dashes_of(const std::vector<CurvePoint>& line);

}  // namespace pictura
