#include "pictura/map/blind_approaches.h"

#include <algorithm>
#include <optional>
#include <set>

#include "pictura/common/grid.h"

namespace pictura {

namespace {

constexpr float kEyeHeight_m = 1.5f;  // above the road, like the cameras
// The box of the crossing vehicle: a CARLA car.
constexpr float kCarLength_m = 4.5f, kCarWidth_m = 2.0f, kCarHeight_m = 1.5f;
constexpr float kSameLevel_m = 2.0f;

/// A path through a junction, with the lanes that lead to it.
struct Path {
  int32_t approach = -1;     // the lane before the junction
  int32_t road = -1;         // of the approach lane
  std::vector<Vec3> points;  // starting far enough before the junction, if the lanes do
  std::vector<float> s_m;    // [points] arc length, 0 at the start of the junction
  size_t first_inside = 0;   // the point at arc length 0
};

bool is_driven(const Lane& lane) { return is_drivable(lane.type) && lane.type != LaneType::parking; }

/// The first predecessor of `lane`, or -1.
int32_t predecessor_of(const RoadMap& map, const Lane& lane) {
  const Span<const int32_t> before = map.links(lane.predecessors);
  return before.empty() ? -1 : before[0];
}

/// Inserts the points of `lane` before those of the path.
void prepend(const RoadMap& map, const Lane& lane, std::vector<Vec3>* points_inout) {
  std::vector<Vec3> points;
  for (const LanePoint& point : map.points_of(lane)) points.push_back(point.position_m);
  if (!points_inout->empty()) points.pop_back();  // the two share a point
  points_inout->insert(points_inout->begin(), points.begin(), points.end());
}

/// The path that begins with this junction lane, if its predecessor is outside the junction.
std::optional<Path> path_through(const RoadMap& map, const Lane& first, float lead_m) {
  const int32_t approach = predecessor_of(map, first);
  if (approach < 0 || map.lanes[static_cast<size_t>(approach)].junction == first.junction) return std::nullopt;
  Path path;
  path.approach = approach;
  path.road = map.lanes[static_cast<size_t>(approach)].source_road;
  for (const LanePoint& point : map.points_of(first)) path.points.push_back(point.position_m);
  // Later sections of the connecting road.
  constexpr int kMaxLanes = 16;
  const Lane* lane = &first;
  for (int i = 0; i < kMaxLanes; ++i) {
    const Span<const int32_t> next = map.links(lane->successors);
    if (next.empty() || map.lanes[static_cast<size_t>(next[0])].junction != first.junction) break;
    lane = &map.lanes[static_cast<size_t>(next[0])];
    const Span<const LanePoint> points = map.points_of(*lane);
    for (size_t k = 1; k < points.size(); ++k) path.points.push_back(points[k].position_m);
  }
  const size_t inside = path.points.size();
  float before_m = 0;
  for (int32_t at = approach, i = 0; at >= 0 && before_m < lead_m && i < kMaxLanes; ++i) {
    lane = &map.lanes[static_cast<size_t>(at)];
    prepend(map, *lane, &path.points);
    before_m += lane->length_m;
    at = predecessor_of(map, *lane);
  }
  path.first_inside = path.points.size() - inside;
  path.s_m.assign(path.points.size(), 0);
  for (size_t i = path.first_inside; i + 1 < path.points.size(); ++i) {
    path.s_m[i + 1] = path.s_m[i] + length((path.points[i + 1] - path.points[i]).xy());
  }
  for (size_t i = path.first_inside; i > 0; --i) {
    path.s_m[i - 1] = path.s_m[i] - length((path.points[i] - path.points[i - 1]).xy());
  }
  return path;
}

/// The fraction of a-b at which c-d crosses it, if it does.
std::optional<float> crossing_fraction(Vec2 a, Vec2 b, Vec2 c, Vec2 d) {
  const Vec2 along = b - a, across = d - c;
  const float area = cross(along, across);
  if (area == 0) return std::nullopt;
  const float fraction = cross(c - a, across) / area, other_fraction = cross(c - a, along) / area;
  if (fraction < 0 || fraction > 1 || other_fraction < 0 || other_fraction > 1) return std::nullopt;
  return fraction;
}

/// Whether two paths cross inside the junction, at the same level.
bool paths_cross(const Path& path, const Path& other) {
  for (size_t i = path.first_inside; i + 1 < path.points.size(); ++i) {
    for (size_t k = other.first_inside; k + 1 < other.points.size(); ++k) {
      const Vec3 a = path.points[i], b = path.points[i + 1], c = other.points[k], d = other.points[k + 1];
      if (std::abs(a.z - c.z) < kSameLevel_m && crossing_fraction(a.xy(), b.xy(), c.xy(), d.xy())) return true;
    }
  }
  return false;
}

struct PathPose {
  Vec3 position_m;
  Vec2 forward;
};

/// Nothing if the path begins after s_m.
std::optional<PathPose> pose_at(const Path& path, float s_m) {
  if (s_m < path.s_m.front()) return std::nullopt;
  const auto after = std::upper_bound(path.s_m.begin() + 1, path.s_m.end() - 1, s_m);
  const size_t i = static_cast<size_t>(after - path.s_m.begin()) - 1;
  const float piece_m = path.s_m[i + 1] - path.s_m[i];
  if (!(piece_m > 0)) return std::nullopt;
  const Vec3 piece = path.points[i + 1] - path.points[i];
  return PathPose{path.points[i] + piece * ((s_m - path.s_m[i]) / piece_m), piece.xy() * (1.0f / piece_m)};
}

/// The walls of a map in a grid, for line-of-sight queries.
class LineOfSight {
 public:
  explicit LineOfSight(Span<const WallFace> walls) : walls_(walls) {
    constexpr float kCell_m = 10.0f;
    std::vector<Aabb2> boxes;
    for (const WallFace& wall : walls) boxes.push_back(box_of(wall.a_m.xy(), wall.b_m.xy()));
    if (!boxes.empty()) grid_ = Grid(boxes, kCell_m);
  }

  /// Whether walls block the view of the corners, side midpoints and centre of a car.
  bool is_hidden(Vec3 eye, const PathPose& car) const {
    for (int along = -1; along <= 1; ++along) {
      for (int side = -1; side <= 1; ++side) {
        const Vec2 xy = car.position_m.xy() + car.forward * (0.5f * kCarLength_m * static_cast<float>(along)) +
                        left_normal(car.forward) * (0.5f * kCarWidth_m * static_cast<float>(side));
        if (!is_blocked(eye, {xy.x, xy.y, car.position_m.z + 0.5f * kCarHeight_m})) return false;
      }
    }
    return true;
  }

 private:
  static Aabb2 box_of(Vec2 a, Vec2 b) {
    return {{std::min(a.x, b.x), std::min(a.y, b.y)}, {std::max(a.x, b.x), std::max(a.y, b.y)}};
  }

  bool is_blocked(Vec3 from, Vec3 to) const {
    if (walls_.empty()) return false;
    bool blocked = false;
    visit_items(grid_.view(), box_of(from.xy(), to.xy()), [&](std::size_t i) {
      if (blocked) return;
      const WallFace& wall = walls_[i];
      const auto fraction = crossing_fraction(from.xy(), to.xy(), wall.a_m.xy(), wall.b_m.xy());
      if (!fraction) return;
      const float above_m = from.z + (to.z - from.z) * *fraction - 0.5f * (wall.a_m.z + wall.b_m.z);
      blocked = above_m >= 0 && above_m <= wall.height_m;
    });
    return blocked;
  }

  Span<const WallFace> walls_;
  Grid grid_;
};

}  // namespace

BlindApproaches count_blind_approaches(const RoadMap& map, Span<const WallFace> walls, float distance_m) {
  std::vector<std::vector<Path>> of_junction(map.junctions.size());
  for (const Lane& lane : map.lanes) {
    if (!lane.in_junction || lane.junction < 0 || !is_driven(lane)) continue;
    if (auto path = path_through(map, lane, distance_m)) {
      of_junction[static_cast<size_t>(lane.junction)].push_back(std::move(*path));
    }
  }
  const LineOfSight line_of_sight(walls);
  BlindApproaches count;
  std::set<int32_t> approaches, blind;
  for (const std::vector<Path>& paths : of_junction) {
    for (const Path& own : paths) {
      for (const Path& other : paths) {
        if (own.road == other.road || !paths_cross(own, other)) continue;
        const auto eye = pose_at(own, -distance_m), car = pose_at(other, -distance_m);
        if (!eye || !car) continue;
        ++count.crossings;
        approaches.insert(own.approach);
        if (!line_of_sight.is_hidden(eye->position_m + Vec3{0, 0, kEyeHeight_m}, *car)) continue;
        ++count.hidden;
        blind.insert(own.approach);
      }
    }
  }
  count.approaches = static_cast<int32_t>(approaches.size());
  count.blind = static_cast<int32_t>(blind.size());
  return count;
}

}  // namespace pictura
