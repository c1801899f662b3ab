// Path of the lane keeper, with gradual lane changes and maximum speeds.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "pictura/map/lane_graph.h"
#include "pictura/simulator/rules/goal.h"

namespace pictura {

/// Lane change, in which the lateral offset from the new lane decreases smoothly to 0.
struct LaneChange {
  float aside_m = 0;  // initial offset to the left of the new lane
  float length_m = 1;
  float done_m = 1;  // completed part of length_m

  float aside_now_m() const;
  float slope() const;  // change of the offset per metre
};

struct PathPoint {
  RoutePoint at;
  LaneChange change;
  Vec3 position_m;
  float heading_rad = 0;
  float speed_mps = 0;  // maximum speed
};

/// Returns the index of the first local minimum, from `from` on, of the distance to place_m.
size_t nearest_point(const std::vector<PathPoint>& path, size_t from, Vec2 place_m);

/// Path with a point every kSpacing_m. `graph` must be the lane graph of `map`. The graph and the arrays of `map` must
/// outlive the path.
class LanePath {
 public:
  static constexpr float kSpacing_m = 0.5f;

  LanePath(const MapView& map, const LaneGraph& graph, RoutePoint from);

  const std::vector<PathPoint>& points() const { return points_; }

  /// Removes the points after point `last`.
  void cut(size_t last);
  /// Extends the path to a point. Returns false, and may leave a wrong extension, if there is no route or no room for
  /// lane changes even with detours.
  bool go_to(RoutePoint to);
  /// Extends the path by about distance_m, or to the end of the lanes. It takes the straightest lane at forks, and
  /// changes from a lane that ends to one beside it that continues.
  void go_on(float distance_m);
  /// Whether there is a fork within distance_m after the path's end.
  bool forks_within(float distance_m) const;
  /// Sets maximum speeds from the curvature and from the braking distance to slower points. The maximum at point `slow`
  /// is at most slow_mps.
  void limit_speeds(size_t slow, float slow_mps);

 private:
  const MapLane& lane(int32_t index) const { return map_.lanes[index]; }
  bool is_change(int32_t from, int32_t to) const { return to == lane(from).left || to == lane(from).right; }
  std::optional<std::vector<int32_t>> route_to(RoutePoint to) const;
  bool follow_route(const std::vector<int32_t>& lanes, RoutePoint to);
  Span<const int32_t> successors_of(int32_t index) const;
  float turn_of(int32_t index) const;
  int32_t best_successor(RoutePoint to) const;
  void change_to(int32_t to, float length_m);
  void follow(float to_s_m);
  void enter(int32_t next) { at_ = {next, 0}; }
  PathPoint end() const;

  MapView map_;
  const LaneGraph* graph_;
  std::vector<PathPoint> points_;
  // State at the end of the path:
  RoutePoint at_;
  LaneChange change_;
  float to_next_m_ = kSpacing_m;
};

}  // namespace pictura
