// Elevation profile of a street between two level junctions.
#pragma once

#include "pictura/map/opendrive/model.h"

namespace pictura::town {

inline constexpr double kMaxGrade = 0.075;
// Fraction of a street's length at each end over which the grade changes.
inline constexpr double kVerticalCurveFraction = 0.25;

inline double max_climb_m(double length_m) { return kMaxGrade * (1 - kVerticalCurveFraction) * length_m; }

/// Returns a parabola, a constant grade and a parabola, level at both ends.
inline opendrive::Profile elevation_profile(double from_m, double to_m, double length_m) {
  if (from_m == to_m) return {{{0, from_m, 0, 0, 0}}};
  const double curve = kVerticalCurveFraction * length_m;
  const double grade = (to_m - from_m) / (length_m - curve);
  const double quadratic = 0.5 * grade / curve;
  return {{{0, from_m, 0, quadratic, 0},
           {curve, from_m + 0.5 * grade * curve, grade, 0, 0},
           {length_m - curve, to_m - 0.5 * grade * curve, grade, -quadratic, 0}}};
}

}  // namespace pictura::town
