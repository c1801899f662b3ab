// The path of a lane-keeping agent: the centre lines of the lanes through its waypoints, lane changes drawn out, and
// how fast its curves can be driven.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "pictura/map/lane_graph.h"
#include "pictura/simulator/rules/goal.h"

namespace pictura {

/// A lane change draws nearer to its lane along a smooth step.
struct LaneChange {
  float aside_m = 0;   // to the left of the lane where it begins
  float length_m = 1;  // along the lane
  float done_m = 1;    // of this

  float aside_now_m() const;
  float slope() const;  // of the way against the lane
};

struct PathPoint {
  RoutePoint at;
  LaneChange change;
  Vec3 position_m;
  float heading_rad = 0;
  float speed_mps = 0;  // at most
};

/// The index of the point nearest to a place, from `from` on for so long as the path comes nearer.
size_t nearest_point(const std::vector<PathPoint>& path, size_t from, Vec2 place_m);

/// Points every kSpacing_m along the route. The graph is that of the view's map; it and the view's arrays must
/// outlive the path.
class LanePath {
 public:
  static constexpr float kSpacing_m = 0.5f;

  LanePath(const MapView& map, const LaneGraph& graph, RoutePoint from);

  const std::vector<PathPoint>& points() const { return points_; }

  /// Forgets what comes after point `last`.
  void cut(size_t last);
  /// Goes on to a place; false where no route leads there, or where lane changes lack room, also after detours: then it
  /// has gone on somewhere.
  bool go_to(RoutePoint to);
  /// Goes on for so long as lanes do, at forks the straightest way; from a lane that ends it changes to one that goes
  /// on.
  void go_on(float distance_m);
  /// Whether the way parts within so far from the end. Where a road ends it does not.
  bool forks_within(float distance_m) const;
  /// Gives every point the speed at which its curve, and by slowing down those ahead, can be driven. Point `slow` is
  /// passed at slow_mps at most.
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
  // Its end:
  RoutePoint at_;
  LaneChange change_;
  float to_next_m_ = kSpacing_m;
};

}  // namespace pictura
