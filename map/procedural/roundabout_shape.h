// Dimensions of roundabouts, and the junctions of their arms with the circle.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

namespace pictura::town {

// The reference line of the circle is its inner edge; traffic circulates counter-clockwise, to the right of the line.
inline constexpr double kCircleLaneWidth_m = 4.5;
constexpr double circle_radius_m(int lanes) { return lanes == 1 ? 12 : 18; }

/// Radius at which the left borders of entries meet the circle, and the left borders of exits leave it. An arm with
/// fewer lanes than the circle uses the circle's outermost lanes.
constexpr double circle_edge_m(int lanes, int arm_lanes) {
  return circle_radius_m(lanes) + (lanes - arm_lanes) * kCircleLaneWidth_m;
}

/// Angle between an arm and the end of its entry on the circle, if the next arm on the side of the entry is `gap_rad`
/// away. The start of an exit is at the same angle. A piece of the circle remains between the two arms.
inline double roundabout_half_angle(double gap_rad) {
  constexpr double kPiece_rad = 16 * std::numbers::pi / 180, kMax_rad = 36 * std::numbers::pi / 180;
  return std::min(0.5 * (gap_rad - kPiece_rad), kMax_rad);
}

/// Distance from the centre at which an arm must end so that its entry is a single arc. The arc is tangent to the arm's
/// centre line, and to the circle of radius `edge_m` (circle_edge_m()) at the angle `half_angle_rad` from the arm.
inline double roundabout_mouth_m(double half_angle_rad, double edge_m) {
  return edge_m / std::cos(half_angle_rad) + edge_m * std::tan(half_angle_rad);
}

}  // namespace pictura::town
