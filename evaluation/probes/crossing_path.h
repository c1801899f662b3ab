// Straight paths of a pedestrian through a frozen state: where one could come out from behind a vehicle, and which part
// of it is hidden, seen, and hidden again. Without torch headers.
#pragma once

#include <optional>
#include <vector>

#include "pictura/common/scene_types.h"
#include "pictura/simulator/observation_query.h"

namespace pictura {

/// Points of a path lie so far apart. It is looked for from so far before the place behind the vehicle to so far after.
constexpr float kPathSpacing_m = 0.5f, kPathBefore_m = 10, kPathAfter_m = 40;
constexpr int kPathOrigin = static_cast<int>(kPathBefore_m / kPathSpacing_m);
constexpr int kPathPoints = kPathOrigin + static_cast<int>(kPathAfter_m / kPathSpacing_m) + 1;
/// What is used of it is hidden for so long, is seen for so long and somewhere almost whole, and is hidden again for so
/// long.
constexpr float kPathHidden_m = 2, kPathSeen_m = 2, kPathWhole = 0.9f;
/// At most so much of each hidden end is kept.
constexpr float kPathEnd_m = 8;

/// Point i is at origin_m + direction * (i - kPathOrigin) * kPathSpacing_m, for i in [0, kPathPoints).
struct CrossingPath {
  Vec2 origin_m;   // behind the vehicle
  Vec2 direction;  // of length 1
  float z_m = 0;

  Vec2 point_m(int i) const { return origin_m + direction * (kPathSpacing_m * static_cast<float>(i - kPathOrigin)); }
  /// Who walks there.
  InsertedBox pedestrian(int i, float height_m) const;
};

/// Six paths through the place just behind a box as seen from `eye_m`: at right angles to the line of sight, and turned
/// by 30 degrees to either side, in both directions.
std::vector<CrossingPath> paths_behind(const AgentBox& box, Vec2 eye_m);

/// [kPathPoints] Whether a pedestrian could stand there: in no drawn box, and in no wall of its height.
std::vector<bool> free_points(const CrossingPath& path, Span<const AgentBox> boxes, Span<const WallFace> walls);

/// Points of a path: hidden from begin on, seen from first_seen on, hidden again from hidden_again on, up to end.
struct PathPart {
  int begin = 0, first_seen = 0, hidden_again = 0, end = 0;
};
/// visible_shares [kPathPoints]: as Renderer::visibility gives them, and NaN where nobody can stand. Nothing where the
/// path is not hidden at its origin, or a part is too short, or cut off by a NaN.
std::optional<PathPart> used_part(Span<const float> visible_shares);

}  // namespace pictura
