// Straight paths on which a pedestrian could emerge from behind a vehicle in a frozen state, and the part of a path on
// which the pedestrian is hidden, seen, and hidden again. Has no torch headers.
#pragma once

#include <optional>
#include <vector>

#include "pictura/common/scene_types.h"
#include "pictura/simulator/observation_query.h"

namespace pictura {

/// Spacing of a path's points, and the range before and after the place behind the vehicle in which a path is searched.
constexpr float kPathSpacing_m = 0.5f, kPathBefore_m = 10, kPathAfter_m = 40;
constexpr int kPathOrigin = static_cast<int>(kPathBefore_m / kPathSpacing_m);
constexpr int kPathPoints = kPathOrigin + static_cast<int>(kPathAfter_m / kPathSpacing_m) + 1;
/// Minimum lengths of the used part: hidden, seen (and at some point almost wholly visible), and hidden again.
constexpr float kPathHidden_m = 2, kPathSeen_m = 2, kPathWhole = 0.9f;
/// Maximum length of each hidden end of the used part.
constexpr float kPathEnd_m = 8;

/// Straight path. Point i is at origin_m + direction * (i - kPathOrigin) * kPathSpacing_m, for i in [0, kPathPoints).
struct CrossingPath {
  Vec2 origin_m;   // behind the vehicle
  Vec2 direction;  // unit vector
  float z_m = 0;

  Vec2 point_m(int i) const { return origin_m + direction * (kPathSpacing_m * static_cast<float>(i - kPathOrigin)); }
  /// The pedestrian at point i.
  InsertedBox pedestrian(int i, float height_m) const;
};

/// Returns six paths through the place just behind a box as seen from `eye_m`: at right angles to the line of sight,
/// and turned by 30 degrees to either side, in both directions.
std::vector<CrossingPath> paths_behind(const AgentBox& box, Vec2 eye_m);

/// Whether a pedestrian could stand at each point, [kPathPoints]: the point is in no drawn box, and in no wall at its
/// height.
std::vector<bool> free_points(const CrossingPath& path, Span<const AgentBox> boxes, Span<const WallFace> walls);

/// Part of a path: hidden from begin on, seen from first_seen on, hidden again from hidden_again on, up to end.
struct PathPart {
  int begin = 0, first_seen = 0, hidden_again = 0, end = 0;
};
/// Returns the used part of a path. visible_shares: [kPathPoints] shares by Renderer::visibility, NaN at points where a
/// pedestrian cannot stand. The result is empty if a pedestrian at the origin is visible, or if the phases do not
/// satisfy the constants above, for instance because a NaN cuts off a phase.
std::optional<PathPart> usable_part(Span<const float> visible_shares);

}  // namespace pictura
