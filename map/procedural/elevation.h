// The heights of a street between two level junctions.
#pragma once

#include "pictura/map/opendrive/model.h"

namespace pictura::town {

inline constexpr double kMaxGrade = 0.075;
// The share of a street over which its grade grows from 0, and falls to 0 again.
inline constexpr double kVerticalCurveShare = 0.25;

/// The greatest difference in height that a street of this length overcomes.
inline double greatest_climb_m(double length_m) { return kMaxGrade * (1 - kVerticalCurveShare) * length_m; }

/// From one height to another: a parabola, a constant grade, a parabola; level at both ends.
inline opendrive::Profile climb(double from_m, double to_m, double length_m) {
  if (from_m == to_m) return {{{0, from_m, 0, 0, 0}}};
  const double curve = kVerticalCurveShare * length_m;
  const double grade = (to_m - from_m) / (length_m - curve);
  const double bend = 0.5 * grade / curve;
  return {{{0, from_m, 0, bend, 0},
           {curve, from_m + 0.5 * grade * curve, grade, 0, 0},
           {length_m - curve, to_m - 0.5 * grade * curve, grade, -bend, 0}}};
}

}  // namespace pictura::town
