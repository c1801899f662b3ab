// Double-precision points and poses on the ground plane. Private to the drawing library.
#pragma once

#include <Eigen/Geometry>

#include "pictura/common/math.h"

namespace pictura {

/// Converts a map point.
inline Eigen::Vector2d in_plan(Vec2 p) { return {p.x, p.y}; }
inline Eigen::Vector2d in_plan(Vec3 p) { return in_plan(p.xy()); }

/// Rounds to the precision of maps.
inline Vec2 rounded(const Eigen::Vector2d& p) { return {static_cast<float>(p.x()), static_cast<float>(p.y())}; }

/// Transform from a local frame (origin position_m, x ahead, y left, in metres) to the map.
inline Eigen::Isometry2d pose_in_plan(const Eigen::Vector2d& position_m, double heading_rad) {
  return Eigen::Translation2d(position_m) * Eigen::Rotation2Dd(heading_rad);
}

/// Transform from a map to a picture with its top left corner at left_top_m and north up.
inline Eigen::Affine2d to_pixels(const Eigen::Vector2d& left_top_m, double px_per_m) {
  return Eigen::Scaling(px_per_m, -px_per_m) * Eigen::Translation2d(-left_top_m);
}

}  // namespace pictura
