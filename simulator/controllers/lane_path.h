// Path of a lane-keeping agent: the centre lines of the lanes through its waypoints, with gradual lane changes, and the
// speeds at which its curves can be driven.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "pictura/map/lane_graph.h"
#include "pictura/simulator/rules/goal.h"

namespace pictura {

/// A lane change: the lateral offset from the new lane decreases along a smooth step.
struct LaneChange {
  float aside_m = 0;   // initial offset to the left of the new lane
  float length_m = 1;  // along the lane
  float done_m = 1;    // completed part of length_m

  float aside_now_m() const;
  float slope() const;  // slope of the way relative to the lane
};

struct PathPoint {
  RoutePoint at;
  LaneChange change;
  Vec3 position_m;
  float heading_rad = 0;
  float speed_mps = 0;  // maximum
};

/// Returns the index of the point nearest to a place: the search continues from `from` as long as points get nearer.
size_t nearest_point(const std::vector<PathPoint>& path, size_t from, Vec2 place_m);

/// Points every kSpacing_m along the route. `graph` is the graph of the view's map; the graph and the view's arrays
/// must outlive the path.
class LanePath {
 public:
  static constexpr float kSpacing_m = 0.5f;

  LanePath(const MapView& map, const LaneGraph& graph, RoutePoint from);

  const std::vector<PathPoint>& points() const { return points_; }

  /// Removes the points after point `last`.
  void cut(size_t last);
  /// Extends the path to a place. Returns false if no route leads to the place, or if lane changes lack room even with
  /// detours; the path is then extended elsewhere.
  bool go_to(RoutePoint to);
  /// Extends the path as far as lanes continue, taking the straightest way at forks. From a lane that ends, it changes
  /// to a lane that continues.
  void go_on(float distance_m);
  /// Whether a fork lies within this distance of the path's end. The end of a road is not a fork.
  bool forks_within(float distance_m) const;
  /// Sets the speed limit of every point from its curve and, by braking, from the points ahead. Point `slow` has a
  /// limit of at most slow_mps.
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
  // End of the path:
  RoutePoint at_;
  LaneChange change_;
  float to_next_m_ = kSpacing_m;
};

}  // namespace pictura
