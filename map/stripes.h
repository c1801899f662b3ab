// Geometry of painted stripes along polylines.
#pragma once

#include <vector>

#include "pictura/map/polyline.h"

namespace pictura {

/// Dashes of 3 m with gaps of 9 m: the North American pattern, as in CARLA's towns.
constexpr double kDash_m = 3.0, kDashPeriod_m = 12.0;

/// Returns the line moved to its left in plan. Sharp corners move by at most twice the offset. The line must have two
/// or more points, without repetitions.
std::vector<CurvePoint> moved_left(const std::vector<CurvePoint>& line, double offset_m);

/// Returns the part between two arc lengths.
std::vector<CurvePoint> part_of(const std::vector<CurvePoint>& line, double begin_m, double end_m);

double plan_length_m(const std::vector<CurvePoint>& line);

/// Returns at least one dash; the dashes are centred.
std::vector<std::vector<CurvePoint>> dashes_of(const std::vector<CurvePoint>& line);

}  // namespace pictura
