// Goal chains. A chain is three waypoints, 20 to 60 m apart, on a random route along the lane network; routes may
// change lanes. On closed maps, routes can continue without end. On open maps, whose roads end, routes end shortly
// before the lanes do.
#pragma once

#include "pictura/common/rng.h"
#include "pictura/simulator/rules/road.h"

namespace pictura {

constexpr float kMinWaypointGap_m = 20.0f, kMaxWaypointGap_m = 60.0f;
constexpr float kLaneChangeChance = 0.25f;
/// Maximum height difference at which an agent passes a waypoint.
constexpr float kWaypointLevel_m = 4.0f;
/// Radius of the metric Goals, which counts last waypoints of chains (paper, metric definitions).
constexpr float kMetricGoalRadius_m = 2.0f;

/// Returns the point on the neighbouring lane (`side` < 0: left) at the same fraction of its length, or `at` if there
/// is no such lane.
PICTURA_HD inline RoutePoint neighbor_of(const MapView& map, RoutePoint at, int side) {
  const MapLane& lane = map.lanes[at.lane];
  const int32_t neighbor = side < 0 ? lane.left : lane.right;
  if (neighbor < 0) return at;
  return {neighbor, at.s_m * (map.lanes[neighbor].length_m / lane.length_m)};
}

/// Returns the point beside `at` on the nearest lane with a successor (left before right). Returns `at` if its own lane
/// has a successor or no lane has one.
PICTURA_HD inline RoutePoint through_lane(const MapView& map, RoutePoint at) {
  const auto goes_on = [&map](RoutePoint p) { return map.lanes[p.lane].num_successors > 0; };
  RoutePoint left = at, right = at;
  while (!goes_on(left) && !goes_on(right)) {
    const RoutePoint next_left = neighbor_of(map, left, -1), next_right = neighbor_of(map, right, 1);
    if (next_left.lane == left.lane && next_right.lane == right.lane) return at;
    left = next_left;
    right = next_right;
  }
  return goes_on(left) ? left : right;
}

/// Returns the point distance_m ahead on a random route with equally likely successors. From a lane without successors,
/// the route continues at through_lane(). The result is never beyond the end of routes.
PICTURA_HD inline RoutePoint advance_along_lanes(const MapView& map, RoutePoint at, float distance_m,
                                                 RandomStream* random_inout) {
  constexpr int kMaxLanesWalked = 64;  // a safety bound
  for (int i = 0; i < kMaxLanesWalked; ++i) {
    const float left_m = map.lanes[at.lane].length_m - at.s_m;
    const float route_end_m = map.lanes[at.lane].route_end_m;
    if (distance_m <= left_m || route_end_m < kRouteGoesOn_m) {
      return {at.lane, min_of(at.s_m + distance_m, route_end_m)};
    }
    at = through_lane(map, at);
    const MapLane& lane = map.lanes[at.lane];
    if (lane.num_successors == 0) break;
    distance_m -= left_m;
    const int choice = random_inout->below(lane.num_successors);
    at = {map.successors[lane.first_successor + choice], 0.0f};
  }
  return {at.lane, map.lanes[at.lane].length_m};
}

/// Returns a point a random gap ahead, after a lane change with probability kLaneChangeChance.
PICTURA_HD inline RoutePoint next_waypoint(const MapView& map, RoutePoint at, RandomStream* random_inout) {
  const float gap_m = random_inout->uniform(kMinWaypointGap_m, kMaxWaypointGap_m);
  const float change = random_inout->uniform();
  if (change < kLaneChangeChance) at = neighbor_of(map, at, change < 0.5f * kLaneChangeChance ? -1 : 1);
  return advance_along_lanes(map, at, gap_m, random_inout);
}

/// Whether the line `from`-`to` comes within radius_m of `goal` in plan, with `to` on the goal's level.
PICTURA_HD inline bool passes(Vec3 from, Vec3 to, Vec3 goal, float radius_m) {
  if (fabsf(to.z - goal.z) >= kWaypointLevel_m) return false;
  const Vec2 way = to.xy() - from.xy();
  const Vec2 to_goal = goal.xy() - from.xy();
  const float way2 = dot(way, way);
  const float t = way2 > 0.0f ? clamp(dot(to_goal, way) / way2, 0.0f, 1.0f) : 0.0f;
  const Vec2 apart = to_goal - way * t;
  return dot(apart, apart) < square(radius_m);
}

}  // namespace pictura
