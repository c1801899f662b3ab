// How wide a roundabout is, and where its arms meet the circle.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

namespace pictura::town {

// The reference line of the circle is its inner edge; traffic circulates counter-clockwise on its right.
inline constexpr double kCircleRadius_m = 12, kCircleLaneWidth_m = 4.5;

/// The angle between an arm and the end of its entry (or the start of its exit) on the circle, where the next arm on
/// that side is `gap_rad` away: so that a piece of the circle is left between the two.
inline double roundabout_half_angle(double gap_rad) {
  constexpr double kPiece_rad = 16 * std::numbers::pi / 180, kMax_rad = 36 * std::numbers::pi / 180;
  return std::min(0.5 * (gap_rad - kPiece_rad), kMax_rad);
}

/// How far from the centre an arm must end for its entry to be one arc that touches the arm's centre line and, at that
/// angle, the circle.
inline double roundabout_mouth_m(double half_angle_rad) {
  return kCircleRadius_m / std::cos(half_angle_rad) + kCircleRadius_m * std::tan(half_angle_rad);
}

}  // namespace pictura::town
