#include "pictura/map/blind_approaches.h"

#include <algorithm>
#include <optional>
#include <set>
#include <utility>

#include "pictura/map/line_of_sight.h"

namespace pictura {

namespace {

constexpr float kEyeHeight_m = 1.5f;  // above the road, like the cameras of vehicles
// Box of the crossing vehicle. It has the size of a CARLA car.
constexpr float kCarLength_m = 4.5f, kCarWidth_m = 2.0f, kCarHeight_m = 1.5f;

/// A path through a junction, including the lanes that lead to it.
struct Path {
  int32_t approach = -1;     // lane before the junction
  int32_t road = -1;         // road of the approach lane
  std::vector<Vec3> points;  // begin at least lead_m before the junction if the lanes are long enough
  std::vector<float> s_m;    // [points] arc length; 0 at the start of the junction
  size_t first_inside = 0;   // index of the point at arc length 0
};

bool is_driven(const Lane& lane) { return is_drivable(lane.type) && lane.type != LaneType::parking; }

/// Returns the first predecessor of `lane`, or -1.
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

/// Returns the path that begins with this junction lane, if its predecessor is outside the junction.
std::optional<Path> path_through(const RoadMap& map, const Lane& first, float lead_m) {
  const int32_t approach = predecessor_of(map, first);
  if (approach < 0 || map.lanes[approach].junction == first.junction) return std::nullopt;
  Path path;
  path.approach = approach;
  path.road = map.lanes[approach].source_road;
  for (const LanePoint& point : map.points_of(first)) path.points.push_back(point.position_m);
  // Adds later sections of the connecting road.
  constexpr int kMaxLanes = 16;
  const Lane* lane = &first;
  for (int i = 0; i < kMaxLanes; ++i) {
    const Span<const int32_t> next = map.links(lane->successors);
    if (next.empty() || map.lanes[next[0]].junction != first.junction) break;
    lane = &map.lanes[next[0]];
    const Span<const LanePoint> points = map.points_of(*lane);
    for (size_t k = 1; k < points.size(); ++k) path.points.push_back(points[k].position_m);
  }
  const size_t inside = path.points.size();
  float before_m = 0;
  for (int32_t at = approach, i = 0; at >= 0 && before_m < lead_m && i < kMaxLanes; ++i) {
    lane = &map.lanes[at];
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

/// Whether two paths cross inside the junction, at the same level.
bool paths_cross(const Path& path, const Path& other) {
  for (size_t i = path.first_inside; i + 1 < path.points.size(); ++i) {
    for (size_t k = other.first_inside; k + 1 < other.points.size(); ++k) {
      const Vec3 a = path.points[i], b = path.points[i + 1], c = other.points[k], d = other.points[k + 1];
      if (std::abs(a.z - c.z) < kSameRoadLevel_m && crossing_fraction(a.xy(), b.xy(), c.xy(), d.xy())) return true;
    }
  }
  return false;
}

struct PathPose {
  Vec3 position_m;
  Vec2 forward;
};

/// Returns the pose at s_m, or nothing if the path begins after s_m.
std::optional<PathPose> pose_at(const Path& path, float s_m) {
  if (s_m < path.s_m.front()) return std::nullopt;
  const auto after = std::upper_bound(path.s_m.begin() + 1, path.s_m.end() - 1, s_m);
  const size_t i = static_cast<size_t>(after - path.s_m.begin()) - 1;
  const float piece_m = path.s_m[i + 1] - path.s_m[i];
  if (!(piece_m > 0)) return std::nullopt;
  const Vec3 piece = path.points[i + 1] - path.points[i];
  return PathPose{path.points[i] + piece * ((s_m - path.s_m[i]) / piece_m), piece.xy() * (1.0f / piece_m)};
}

AgentBox car_at(const PathPose& pose) {
  return {.center_m = pose.position_m,
          .cos_heading = pose.forward.x,
          .sin_heading = pose.forward.y,
          .length_m = kCarLength_m,
          .width_m = kCarWidth_m,
          .height_m = kCarHeight_m};
}

/// Calls f(own path, other path, is_hidden) for ordered pairs of crossing paths. `is_hidden` tells whether the car on
/// the other path is hidden.
template <typename F>
void visit_crossings(const RoadMap& map, Span<const WallFace> walls, float distance_m, const F& f) {
  std::vector<std::vector<Path>> of_junction(map.junctions.size());
  for (const Lane& lane : map.lanes) {
    if (!lane.in_junction || lane.junction < 0 || !is_driven(lane)) continue;
    if (auto path = path_through(map, lane, distance_m)) {
      of_junction[lane.junction].push_back(std::move(*path));
    }
  }
  const LineOfSight line_of_sight(walls);
  for (const std::vector<Path>& paths : of_junction) {
    for (const Path& own : paths) {
      for (const Path& other : paths) {
        if (own.road == other.road || !paths_cross(own, other)) continue;
        const auto eye = pose_at(own, -distance_m), car = pose_at(other, -distance_m);
        if (!eye || !car) continue;
        f(own, other, line_of_sight.is_hidden(eye->position_m + Vec3{0, 0, kEyeHeight_m}, car_at(*car)));
      }
    }
  }
}

}  // namespace

BlindApproaches count_blind_approaches(const RoadMap& map, Span<const WallFace> walls, float distance_m) {
  BlindApproaches count;
  std::set<int32_t> approaches, blind;
  visit_crossings(map, walls, distance_m, [&](const Path& own, const Path&, bool is_hidden) {
    ++count.crossings;
    approaches.insert(own.approach);
    if (!is_hidden) return;
    ++count.hidden;
    blind.insert(own.approach);
  });
  count.approaches = static_cast<int32_t>(approaches.size());
  count.blind = static_cast<int32_t>(blind.size());
  return count;
}

std::vector<BlindCrossing> find_blind_crossings(const RoadMap& map, Span<const WallFace> walls, float distance_m) {
  std::set<std::pair<int32_t, int32_t>> found;
  visit_crossings(map, walls, distance_m, [&found](const Path& own, const Path& other, bool is_hidden) {
    if (is_hidden) found.insert({own.approach, other.approach});
  });
  std::vector<BlindCrossing> crossings;
  for (const auto& [approach, other] : found) crossings.push_back({approach, other});
  return crossings;
}

}  // namespace pictura
