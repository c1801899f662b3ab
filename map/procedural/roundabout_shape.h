// Dimensions of roundabouts.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

namespace pictura::town {

// The circle's reference line is its inner edge. Traffic circulates counter-clockwise.
inline constexpr double kCircleLaneWidth_m = 4.5;
constexpr double circle_radius_m(int lanes) { return lanes == 1 ? 12 : 18; }

/// Radius at which the left borders of entries and exits meet the circle. Arms with fewer lanes use its outermost
/// lanes.
constexpr double circle_edge_m(int lanes, int arm_lanes) {
  return circle_radius_m(lanes) + (lanes - arm_lanes) * kCircleLaneWidth_m;
}

/// Angle between an arm and the end of its entry, or the start of its exit, on the circle. `gap_rad` is the angle to
/// the next arm on that side. A piece of the circle remains between the arms.
inline double roundabout_half_angle(double gap_rad) {
  constexpr double kPiece_rad = 16 * std::numbers::pi / 180, kMax_rad = 36 * std::numbers::pi / 180;
  return std::min(0.5 * (gap_rad - kPiece_rad), kMax_rad);
}

/// Distance from the centre at which an arm ends, so that its entry is a single arc. The arc is tangent to the arm, and
/// to the circle of radius `edge_m` at `half_angle_rad` from the arm.
inline double roundabout_mouth_m(double half_angle_rad, double edge_m) {
  return edge_m / std::cos(half_angle_rad) + edge_m * std::tan(half_angle_rad);
}

}  // namespace pictura::town
