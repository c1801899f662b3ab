// Reference lines in plan: lines and arcs from one pose to another, in double.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "pictura/map/opendrive/model.h"

namespace pictura::town {

inline constexpr double kPi_rad = std::numbers::pi;

struct Pose {
  double x = 0, y = 0, heading = 0;
};

inline Pose moved_forward(Pose p, double distance_m) {
  return {p.x + distance_m * std::cos(p.heading), p.y + distance_m * std::sin(p.heading), p.heading};
}
inline Pose offset_right(Pose p, double distance_m) {
  return {p.x + distance_m * std::sin(p.heading), p.y - distance_m * std::cos(p.heading), p.heading};
}
inline Pose reversed(Pose p) { return {p.x, p.y, p.heading + kPi_rad}; }

/// In [-pi, pi].
inline double wrap_to_pi(double angle_rad) { return std::remainder(angle_rad, 2 * kPi_rad); }
/// In [0, 2 pi).
inline double wrap_to_2pi(double angle_rad) {
  const double angle = wrap_to_pi(angle_rad);
  return angle < 0 ? angle + 2 * kPi_rad : angle;
}

using Curve = std::vector<opendrive::GeometryPiece>;

inline opendrive::GeometryPiece piece_of(Pose start, double length_m, double curvature) {
  return {0, start.x, start.y, wrap_to_pi(start.heading), length_m, curvature, curvature, {}};
}

/// Sets the stations of the pieces and returns the curve's length.
inline double assign_stations(Curve* curve) {
  double s = 0;
  for (opendrive::GeometryPiece& piece : *curve) {
    piece.s = s;
    s += piece.length;
  }
  return s;
}

inline double max_curvature(const Curve& curve) {
  double sharpest = 0;
  for (const opendrive::GeometryPiece& piece : curve) sharpest = std::max(sharpest, std::abs(piece.start_curvature));
  return sharpest;
}

/// The arc (or line) that leaves `from` along its heading and ends at (x, y).
inline opendrive::GeometryPiece arc_to(Pose from, double x, double y) {
  const double chord = std::hypot(x - from.x, y - from.y);
  const double chord_heading = std::atan2(y - from.y, x - from.x);
  const double half_turn = wrap_to_pi(chord_heading - from.heading);
  if (std::abs(half_turn) < 1e-9) return piece_of({from.x, from.y, chord_heading}, chord, 0);
  return piece_of(from, chord * half_turn / std::sin(half_turn), 2 * std::sin(half_turn) / chord);
}

/// A biarc: two arcs with a common tangent and equal control arms; one piece where that is enough.
inline Curve biarc(Pose from, Pose to) {
  const double from_x = std::cos(from.heading), from_y = std::sin(from.heading);
  const double to_x = std::cos(to.heading), to_y = std::sin(to.heading);
  const double dx = to.x - from.x, dy = to.y - from.y;
  const double along = dx * (from_x + to_x) + dy * (from_y + to_y);
  const double chord2 = dx * dx + dy * dy;
  const double quadratic = 2 * (1 - (from_x * to_x + from_y * to_y));
  const double arm = chord2 / (along + std::sqrt(along * along + quadratic * chord2));
  const double middle_x = 0.5 * (from.x + to.x + arm * (from_x - to_x));
  const double middle_y = 0.5 * (from.y + to.y + arm * (from_y - to_y));
  const opendrive::GeometryPiece first = arc_to(from, middle_x, middle_y);
  const Pose joint{middle_x, middle_y, from.heading + first.start_curvature * first.length};
  const opendrive::GeometryPiece second = arc_to(joint, to.x, to.y);
  if (std::abs(first.start_curvature - second.start_curvature) < 1e-9) return {arc_to(from, to.x, to.y)};
  return {first, second};
}

/// A fillet: line, arc and line, tangent to each other, with the largest radius that fits but at most `max_radius_m`; a
/// biarc if the tangents do not intersect between the poses.
inline Curve fillet(Pose from, Pose to, double max_radius_m) {
  constexpr double kMinTurn_rad = 0.1, kMinLine_m = 1e-7;
  const double turn = wrap_to_pi(to.heading - from.heading);
  if (std::abs(turn) < kMinTurn_rad) return biarc(from, to);
  const double sine = std::sin(turn);
  const double dx = to.x - from.x, dy = to.y - from.y;
  // Distances from both ends to the intersection of their tangents.
  const double lead_in = (dx * std::sin(to.heading) - dy * std::cos(to.heading)) / sine;
  const double lead_out = (dy * std::cos(from.heading) - dx * std::sin(from.heading)) / sine;
  if (lead_in <= 0 || lead_out <= 0) return biarc(from, to);
  const double half_tangent = std::tan(0.5 * std::abs(turn));
  const double tangent = std::min({lead_in, lead_out, max_radius_m * half_tangent});
  const double curvature = std::copysign(half_tangent / tangent, turn);
  Curve curve;
  if (lead_in - tangent > kMinLine_m) curve.push_back(piece_of(from, lead_in - tangent, 0));
  curve.push_back(piece_of(moved_forward(from, lead_in - tangent), turn / curvature, curvature));
  if (lead_out - tangent > kMinLine_m) {
    curve.push_back(piece_of(moved_forward(to, tangent - lead_out), lead_out - tangent, 0));
  }
  return curve;
}

}  // namespace pictura::town
