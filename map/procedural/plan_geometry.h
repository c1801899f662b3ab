// Reference lines in plan: lines and arcs from one pose to another.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/Core>

#include "pictura/common/hypot.h"
#include "pictura/map/opendrive/model.h"

namespace pictura::town {

inline constexpr double kPi_rad = std::numbers::pi;

struct Pose {
  Eigen::Vector2d position_m{0, 0};
  double heading = 0;
};

inline Eigen::Vector2d direction_of(double heading) { return {std::cos(heading), std::sin(heading)}; }
inline Pose moved_forward(const Pose& p, double distance_m) {
  return {p.position_m + distance_m * direction_of(p.heading), p.heading};
}
inline Pose offset_right(const Pose& p, double distance_m) {
  const Eigen::Vector2d right{std::sin(p.heading), -std::cos(p.heading)};
  return {p.position_m + distance_m * right, p.heading};
}
inline Pose reversed(const Pose& p) { return {p.position_m, p.heading + kPi_rad}; }

/// z component of the cross product.
inline double cross_of(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

/// Wraps to [-pi, pi].
inline double wrap_to_pi(double angle_rad) { return std::remainder(angle_rad, 2 * kPi_rad); }
/// Wraps to [0, 2 pi).
inline double wrap_to_2pi(double angle_rad) {
  const double angle = wrap_to_pi(angle_rad);
  return angle < 0 ? angle + 2 * kPi_rad : angle;
}

using Curve = std::vector<opendrive::GeometryPiece>;

inline opendrive::GeometryPiece piece_of(const Pose& start, double length_m, double curvature) {
  return {0, start.position_m.x(), start.position_m.y(), wrap_to_pi(start.heading), length_m, curvature, curvature, {}};
}

/// Sets the stations, and returns the curve's length.
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

/// Returns the arc or line from `from` to `to_m`.
inline opendrive::GeometryPiece arc_to(const Pose& from, const Eigen::Vector2d& to_m) {
  const Eigen::Vector2d apart = to_m - from.position_m;
  const double chord = hypot_of(apart.x(), apart.y());
  const double chord_heading = std::atan2(apart.y(), apart.x());
  const double half_turn = wrap_to_pi(chord_heading - from.heading);
  if (std::abs(half_turn) < 1e-9) return piece_of({from.position_m, chord_heading}, chord, 0);
  return piece_of(from, chord * half_turn / std::sin(half_turn), 2 * std::sin(half_turn) / chord);
}

/// Returns a biarc with equal tangent lengths at both ends, or a single arc if the two arcs have equal curvature. The
/// way from `from` to `to` must point forward: backward, the curve would be nearly a circle, or not finite.
inline Curve biarc(const Pose& from, const Pose& to) {
  const Eigen::Vector2d leaving = direction_of(from.heading), arriving = direction_of(to.heading);
  const Eigen::Vector2d chord = to.position_m - from.position_m;
  const double along = chord.dot(leaving + arriving);
  const double chord2 = chord.squaredNorm();
  const double quadratic = 2 * (1 - leaving.dot(arriving));
  const double arm = chord2 / (along + std::sqrt(along * along + quadratic * chord2));
  const Eigen::Vector2d middle = 0.5 * (from.position_m + to.position_m + arm * (leaving - arriving));
  const opendrive::GeometryPiece first = arc_to(from, middle);
  const Pose joint{middle, from.heading + first.start_curvature * first.length};
  const opendrive::GeometryPiece second = arc_to(joint, to.position_m);
  if (std::abs(first.start_curvature - second.start_curvature) < 1e-9) return {arc_to(from, to.position_m)};
  return {first, second};
}

inline constexpr double kNoRadiusLimit_m = 1e9;  // for max_radius_m

/// Returns a line, an arc and a line, tangent to each other, with the largest radius up to `max_radius_m`. Returns a
/// biarc if the turn is less than 0.1 rad, or if the tangents do not intersect between the poses.
inline Curve fillet(const Pose& from, const Pose& to, double max_radius_m) {
  constexpr double kMinTurn_rad = 0.1, kMinLine_m = 1e-7;
  const double turn = wrap_to_pi(to.heading - from.heading);
  if (std::abs(turn) < kMinTurn_rad) return biarc(from, to);
  const double sine = std::sin(turn);
  const Eigen::Vector2d chord = to.position_m - from.position_m;
  // Distances from both ends to the tangents' intersection.
  const double lead_in = cross_of(chord, direction_of(to.heading)) / sine;
  const double lead_out = cross_of(direction_of(from.heading), chord) / sine;
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
