#include "pictura/simulator/controllers/lane_path.h"

#include <algorithm>
#include <cmath>

#include "pictura/common/error.h"
#include "pictura/simulator/controllers/goal_places.h"

namespace pictura {

namespace {

bool contains(Span<const int32_t> lanes, int32_t lane) {
  return std::find(lanes.begin(), lanes.end(), lane) != lanes.end();
}

}  // namespace

float LaneChange::aside_now_m() const {
  const float u = std::min(done_m / length_m, 1.0f);
  return aside_m * (1 - u * u * (3 - 2 * u));
}

float LaneChange::slope() const {
  const float u = std::min(done_m / length_m, 1.0f);
  return -aside_m * 6 * u * (1 - u) / length_m;
}

size_t nearest_point(const std::vector<PathPoint>& path, size_t from, Vec2 place_m) {
  const auto apart_m = [&](size_t i) { return length(path[i].position_m.xy() - place_m); };
  while (from + 1 < path.size() && apart_m(from + 1) <= apart_m(from)) ++from;
  return from;
}

LanePath::LanePath(const MapView& map, const LaneGraph& graph, RoutePoint from) : map_(map), graph_(&graph), at_(from) {
  points_.push_back(end());
}

void LanePath::cut(size_t last) {
  points_.resize(last + 1);
  at_ = points_.back().at;
  change_ = points_.back().change;
  to_next_m_ = kSpacing_m;
}

bool LanePath::go_to(RoutePoint to) {
  constexpr int kMaxDetours = 4;
  for (int detour = 0; detour <= kMaxDetours; ++detour) {
    const std::optional<std::vector<int32_t>> route = route_to(to);
    if (!route) return false;
    if (follow_route(*route, to)) return true;
    follow(lane(at_.lane).length_m);
    const int32_t next = best_successor(to);
    if (next < 0) return false;
    enter(next);
  }
  return false;
}

/// Returns the lanes of a route to a point, or nullopt if there is no route. Each lane change is as early as possible.
std::optional<std::vector<int32_t>> LanePath::route_to(RoutePoint to) const {
  const auto route = graph_->route(lane_place(map_, *graph_, at_), lane_place(map_, *graph_, to));
  if (!route) return std::nullopt;
  std::vector<int32_t> lanes = route->lanes;
  for (bool is_done = false; !is_done;) {
    is_done = true;
    for (size_t i = 1; i + 1 < lanes.size(); ++i) {
      if (is_change(lanes[i - 1], lanes[i]) || !is_change(lanes[i], lanes[i + 1])) continue;
      for (const int32_t neighbor : {lane(lanes[i - 1]).left, lane(lanes[i - 1]).right}) {
        if (neighbor < 0 || !contains(successors_of(neighbor), lanes[i + 1])) continue;
        lanes[i] = neighbor;
        is_done = false;
        break;
      }
    }
  }
  return lanes;
}

/// Extends the path along a route. If there is no room for a lane change that is not forced by the end of a lane, stops
/// before the change and returns false.
bool LanePath::follow_route(const std::vector<int32_t>& lanes, RoutePoint to) {
  constexpr float kMinChange_m = 12;  // per lane change
  for (size_t i = 1; i < lanes.size(); ++i) {
    if (!is_change(at_.lane, lanes[i])) {
      follow(lane(at_.lane).length_m);
      enter(lanes[i]);
      continue;
    }
    const size_t first = i;
    while (i + 1 < lanes.size() && is_change(lanes[i], lanes[i + 1])) ++i;
    const float length_m = lane(lanes[i]).length_m;
    const float left_m = (i + 1 == lanes.size() ? to.s_m : length_m) - length_m * (at_.s_m / lane(at_.lane).length_m);
    const bool fits = left_m >= kMinChange_m * static_cast<float>(i + 1 - first);
    if (!fits && lane(at_.lane).num_successors > 0) return false;
    change_to(lanes[i], left_m);
  }
  follow(to.s_m);
  return true;
}

void LanePath::go_on(float distance_m) {
  while (distance_m > 0) {
    const RoutePoint through = through_lane(map_, at_);
    if (lane(through.lane).num_successors == 0) {
      if (lane(at_.lane).route_end_m < kRouteGoesOn_m) follow(lane(at_.lane).length_m);  // up to the exit
      break;
    }
    if (through.lane != at_.lane) change_to(through.lane, lane(through.lane).length_m - through.s_m);
    distance_m -= lane(at_.lane).length_m - at_.s_m;
    follow(lane(at_.lane).length_m);
    const Span<const int32_t> next = successors_of(at_.lane);
    enter(
        *std::min_element(next.begin(), next.end(), [this](int32_t a, int32_t b) { return turn_of(a) < turn_of(b); }));
  }
}

/// Returns the successors on which a route may continue.
Span<const int32_t> LanePath::successors_of(int32_t index) const {
  return map_.successors.subspan(lane(index).first_successor, lane(index).num_successors);
}

/// Returns the absolute change of heading between the ends of a lane.
float LanePath::turn_of(int32_t index) const {
  return std::fabs(wrap_angle(pose_on_lane(map_, index, lane(index).length_m).heading_rad -
                              pose_on_lane(map_, index, 0).heading_rad));
}

/// Returns the successor with the shortest route to `to`; -1 if there is no route.
int32_t LanePath::best_successor(RoutePoint to) const {
  int32_t best = -1;
  double minimum = INFINITY;
  for (const int32_t next : successors_of(at_.lane)) {
    const auto route = graph_->route({next, 0}, lane_place(map_, *graph_, to));
    if (!route || route->length_m >= minimum) continue;
    minimum = route->length_m;
    best = next;
  }
  return best;
}

/// Begins a change to a neighbouring lane. The change is completed within length_m if that is long enough.
void LanePath::change_to(int32_t to, float length_m) {
  constexpr float kMin_m = 8, kPerMetreAside = 7;
  const Vec2 here = end().position_m.xy();
  Foot best;
  best.distance_m = INFINITY;
  for (int32_t i = 0; i < lane(to).num_segments; ++i) {
    const LaneSegment& segment = map_.segments[lane(to).first_segment + i];
    const Foot foot = foot_on(segment, here);
    if (foot.distance_m >= best.distance_m) continue;
    best = foot;
    at_ = {to, segment.s_m + foot.along_m};
  }
  const float aside_m = std::copysign(best.distance_m, best.side);
  change_ = {aside_m, std::max(kMin_m, std::min(length_m, kPerMetreAside * best.distance_m)), 0};
}

void LanePath::follow(float to_s_m) {
  while (at_.s_m + to_next_m_ <= to_s_m) {
    at_.s_m += to_next_m_;
    change_.done_m += to_next_m_;
    to_next_m_ = kSpacing_m;
    points_.push_back(end());
  }
  const float rest_m = std::max(to_s_m - at_.s_m, 0.0f);
  at_.s_m += rest_m;
  change_.done_m += rest_m;
  to_next_m_ -= rest_m;
}

PathPoint LanePath::end() const {
  const LanePose pose = pose_on_lane(map_, at_.lane, at_.s_m);
  const SinCos heading = sincos_of(pose.heading_rad);
  const Vec2 aside = left_normal({heading.cos, heading.sin}) * change_.aside_now_m();
  return {at_, change_, pose.position_m + Vec3{aside.x, aside.y, 0},
          wrap_angle(pose.heading_rad + std::atan(change_.slope())), 0};
}

bool LanePath::forks_within(float distance_m) const {
  RoutePoint at = at_;
  while (distance_m > 0 && lane(at.lane).num_successors == 1) {
    distance_m -= lane(at.lane).length_m - at.s_m;
    at = {successors_of(at.lane)[0], 0};
  }
  return distance_m > 0 && lane(at.lane).route_end_m == kRouteGoesOn_m;
}

void LanePath::limit_speeds(size_t slow, float slow_mps) {
  constexpr float kFastest_mps = 8, kShareOfLimit = 0.8f;
  constexpr float kSideways_mps2 = 1.5f, kBraking_mps2 = 1.0f;
  constexpr size_t kWindow = 4;  // number of points over which the curvature is measured
  for (size_t i = points_.size(); i-- > 0;) {
    PathPoint& point = points_[i];
    const size_t behind = i - std::min(i, kWindow / 2), ahead = std::min(i + kWindow / 2, points_.size() - 1);
    const float turn = std::fabs(wrap_angle(points_[ahead].heading_rad - points_[behind].heading_rad));
    const float curvature = turn / (kSpacing_m * static_cast<float>(kWindow)) + 1e-4f;
    point.speed_mps = std::min(
        {kFastest_mps, kShareOfLimit * lane(point.at.lane).speed_limit_mps, std::sqrt(kSideways_mps2 / curvature)});
    if (i == slow) point.speed_mps = std::min(point.speed_mps, slow_mps);
    if (i + 1 == points_.size()) continue;
    point.speed_mps =
        std::min(point.speed_mps, std::sqrt(square(points_[i + 1].speed_mps) + 2 * kBraking_mps2 * kSpacing_m));
  }
}

}  // namespace pictura
