// Straight paths, in a frozen state, on which a pedestrian could emerge from behind a vehicle. On the used part of a
// path the pedestrian is hidden, then seen, then hidden again. Includes no torch headers.
#pragma once

#include <optional>
#include <vector>

#include "pictura/common/scene_types.h"
#include "pictura/simulator/observation_query.h"

namespace pictura {

/// Spacing of a path's points, and length of a path before and after its origin, which is just behind the vehicle.
constexpr float kPathSpacing_m = 0.5f, kPathBefore_m = 10, kPathAfter_m = 40;
constexpr int kPathOrigin = static_cast<int>(kPathBefore_m / kPathSpacing_m);
constexpr int kPathPoints = kPathOrigin + static_cast<int>(kPathAfter_m / kPathSpacing_m) + 1;
/// Conditions on the used part of a path. Each hidden end must be kPathHidden_m long or longer, the seen part
/// kPathSeen_m or longer. At some point of the seen part, the visible share of the pedestrian must be at least
/// kPathWhole.
constexpr float kPathHidden_m = 2, kPathSeen_m = 2, kPathWhole = 0.9f;
/// Maximum length of each hidden end of the used part.
constexpr float kPathEnd_m = 8;

/// Straight path. Point i is at origin_m + direction * (i - kPathOrigin) * kPathSpacing_m, for i in [0, kPathPoints).
struct CrossingPath {
  Vec2 origin_m;   // behind the vehicle
  Vec2 direction;  // unit vector
  float z_m = 0;

  Vec2 point_m(int i) const { return origin_m + direction * (kPathSpacing_m * static_cast<float>(i - kPathOrigin)); }
  /// Returns the pedestrian at point i.
  InsertedBox pedestrian(int i, float height_m) const;
};

/// Returns six paths whose origin is just behind a box, as seen from `eye_m`. They cross the line of sight at 60, 90
/// and 120 degrees, each in both directions.
std::vector<CrossingPath> paths_behind(const AgentBox& box, Vec2 eye_m);

/// Returns for each point, [kPathPoints], whether a pedestrian could stand there: no drawn box or wall on the path's
/// level covers the point.
std::vector<bool> free_points(const CrossingPath& path, Span<const AgentBox> boxes, Span<const WallFace> walls);

/// Part of a path, in indices of points. The pedestrian is hidden in [begin, first_seen), seen in [first_seen,
/// hidden_again), and hidden again in [hidden_again, end).
struct PathPart {
  int begin = 0, first_seen = 0, hidden_again = 0, end = 0;
};
/// Returns the used part of a path. visible_shares: [kPathPoints] visible shares of the pedestrian by
/// Renderer::visibility, NaN at points where a pedestrian cannot stand. The result is empty if the pedestrian is
/// visible at the origin, or if the part violates the conditions above, for instance because a NaN cuts it off.
std::optional<PathPart> usable_part(Span<const float> visible_shares);

}  // namespace pictura
