// Plan views in double precision: points, poses, and the transform from a map to a picture of it. Private to the
// drawing library.
#pragma once

#include <Eigen/Geometry>

#include "pictura/common/math.h"

namespace pictura {

/// A point of a map in plan.
inline Eigen::Vector2d in_plan(Vec2 p) { return {p.x, p.y}; }
inline Eigen::Vector2d in_plan(Vec3 p) { return in_plan(p.xy()); }

/// The same as a map holds it.
inline Vec2 rounded(const Eigen::Vector2d& p) { return {static_cast<float>(p.x()), static_cast<float>(p.y())}; }

/// From x ahead of a place and y to the left of it, in metres, to the map.
inline Eigen::Isometry2d pose_in_plan(const Eigen::Vector2d& position_m, double heading_rad) {
  return Eigen::Translation2d(position_m) * Eigen::Rotation2Dd(heading_rad);
}

/// From a map to a picture whose top left corner shows left_top_m; north is up.
inline Eigen::Affine2d to_pixels(const Eigen::Vector2d& left_top_m, double px_per_m) {
  return Eigen::Scaling(px_per_m, -px_per_m) * Eigen::Translation2d(-left_top_m);
}

}  // namespace pictura
