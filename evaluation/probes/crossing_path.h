// Straight paths in a frozen state, on which a pedestrian could emerge from behind a vehicle.
#pragma once

#include <optional>
#include <vector>

#include "pictura/common/scene_types.h"
#include "pictura/simulator/observation_query.h"

namespace pictura {

/// Spacing of a path's points, and the path's lengths before and after its origin, which is just behind the vehicle.
constexpr float kPathSpacing_m = 0.5f, kPathBefore_m = 10, kPathAfter_m = 40;
constexpr int kPathOrigin = static_cast<int>(kPathBefore_m / kPathSpacing_m);
constexpr int kPathPoints = kPathOrigin + static_cast<int>(kPathAfter_m / kPathSpacing_m) + 1;
/// A usable path has a seen part between two hidden ends (PathPart). Minimum lengths of each end and of the seen part.
/// The visible share must reach kPathWhole at a point of the seen part.
constexpr float kPathHidden_m = 2, kPathSeen_m = 2, kPathWhole = 0.9f;
/// Maximum length of each hidden end.
constexpr float kPathEnd_m = 8;

/// Straight path of the points i in [0, kPathPoints).
struct CrossingPath {
  Vec2 origin_m;   // behind the vehicle
  Vec2 direction;  // unit vector
  float z_m = 0;

  Vec2 point_m(int i) const { return origin_m + direction * (kPathSpacing_m * static_cast<float>(i - kPathOrigin)); }
  InsertedBox pedestrian(int i, float height_m) const;
};

/// Returns six paths whose origin is just behind a box, seen from `eye_m`. They cross the line of sight at 60, 90 and
/// 120 degrees in both directions.
std::vector<CrossingPath> paths_behind(const AgentBox& box, Vec2 eye_m);

/// Returns [kPathPoints]: whether no drawn box or wall on the path's level covers the point.
std::vector<bool> free_points(const CrossingPath& path, Span<const AgentBox> boxes, Span<const WallFace> walls);

/// Part of a path, in point indices. The pedestrian is hidden in [begin, first_seen), seen in [first_seen,
/// hidden_again), and hidden in [hidden_again, end).
struct PathPart {
  int begin = 0, first_seen = 0, hidden_again = 0, end = 0;
};
/// visible_shares: [kPathPoints] visible shares of the pedestrian, NaN where it cannot stand. Returns an empty value if
/// the pedestrian is not hidden at the origin, or if kPathHidden_m, kPathSeen_m or kPathWhole is not reached.
std::optional<PathPart> usable_part(Span<const float> visible_shares);

}  // namespace pictura
