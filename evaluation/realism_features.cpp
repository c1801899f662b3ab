#include "pictura/evaluation/realism_features.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "pictura/map/scenario/road_side.h"

namespace pictura {

namespace {

constexpr double kUndefined = std::numeric_limits<double>::quiet_NaN(), kFar = std::numeric_limits<double>::infinity();
constexpr double kDegree = M_PI / 180;
constexpr double kMaxHeadingDifference = 75 * kDegree, kMaxAlignedDifference = 10 * kDegree, kSmallOverlap_m = 0.5;
constexpr double kLineHeading = 45 * kDegree, kLineHeight_m = 2;

struct Point {
  double x = 0, y = 0;
};
Point operator-(Point a, Point b) { return {a.x - b.x, a.y - b.y}; }
double dot(Point a, Point b) { return a.x * b.x + a.y * b.y; }
double cross(Point a, Point b) { return a.x * b.y - a.y * b.x; }

/// Box without the rounding of its corners: axes, and half sides reduced by the radius of the corners.
struct Core {
  Point center, forward, left;
  double half_length, half_width, radius;

  explicit Core(const RealismBox& box)
      : center{box.x_m, box.y_m},
        forward{std::cos(box.heading_rad), std::sin(box.heading_rad)},
        left{-forward.y, forward.x},
        half_length(box.length_m / 2),
        half_width(box.width_m / 2),
        radius(kCornerRounding * std::min(half_length, half_width)) {
    half_length -= radius;
    half_width -= radius;
  }

  double reach_along(Point axis) const {
    return half_length * std::abs(dot(forward, axis)) + half_width * std::abs(dot(left, axis));
  }
  std::array<Point, 4> corners() const {
    std::array<Point, 4> points;
    size_t i = 0;
    for (const double along : {-half_length, half_length}) {
      for (const double across : {-half_width, half_width}) {
        points[i++] = {center.x + along * forward.x + across * left.x, center.y + along * forward.y + across * left.y};
      }
    }
    return points;
  }
  /// Returns the distance to a point outside the core.
  double distance_to(Point point) const {
    const Point away = point - center;
    return std::hypot(std::max(std::abs(dot(away, forward)) - half_length, 0.0),
                      std::max(std::abs(dot(away, left)) - half_width, 0.0));
  }
};

/// Road edge in the plane; the road is on its right.
struct PlaneEdge {
  Point a, way;
  int32_t before, next;

  explicit PlaneEdge(const SideEdge& edge)
      : a{static_cast<double>(edge.a_m.x), static_cast<double>(edge.a_m.y)},
        way{static_cast<double>(edge.b_m.x) - a.x, static_cast<double>(edge.b_m.y) - a.y},
        before(edge.before),
        next(edge.next) {}
  bool has_on_road_side(Point point) const { return cross(way, point - a) <= 0; }
};

double wrapped(double angle_rad) { return std::remainder(angle_rad, 2 * M_PI); }

RealismBox box_of(const RealismObject& object, const RealismPose& pose) {
  return {pose.x_m, pose.y_m, pose.heading_rad, object.length_m, object.width_m};
}

/// Returns speeds in three dimensions, by central differences.
std::vector<double> speeds_mps(Span<const RealismPose> poses, double dt_s) {
  std::vector<double> speeds(poses.size(), kUndefined);
  for (size_t i = 1; i + 1 < poses.size(); ++i) {
    const RealismPose &before = poses[i - 1], &after = poses[i + 1];
    if (!before.is_valid || !after.is_valid) continue;
    speeds[i] = std::hypot(after.x_m - before.x_m, after.y_m - before.y_m, after.z_m - before.z_m) / (2 * dt_s);
  }
  return speeds;
}

}  // namespace

const char* to_string(RealismFeature feature) {
  constexpr std::array<const char*, kNumRealismFeatures> kNames{"linear_speed",
                                                                "linear_acceleration",
                                                                "angular_speed",
                                                                "angular_acceleration",
                                                                "distance_to_nearest_object",
                                                                "collision",
                                                                "time_to_collision",
                                                                "distance_to_road_edge",
                                                                "off_road",
                                                                "red_light"};
  return kNames[static_cast<size_t>(feature)];
}

double rounded_box_distance_m(const RealismBox& box_a, const RealismBox& box_b) {
  const Core a(box_a), b(box_b);
  // Separating axis theorem: two boxes are either apart along one of their axes, or they overlap.
  double gap = -kFar;
  for (const Point axis : {a.forward, a.left, b.forward, b.left}) {
    gap = std::max(gap, std::abs(dot(b.center - a.center, axis)) - a.reach_along(axis) - b.reach_along(axis));
  }
  if (gap > 0) {
    gap = kFar;
    for (const Point corner : a.corners()) gap = std::min(gap, b.distance_to(corner));
    for (const Point corner : b.corners()) gap = std::min(gap, a.distance_to(corner));
  }
  return gap - a.radius - b.radius;
}

double time_to_collision_s(const RealismBox& follower, double follower_mps, const RealismBox& leader, double leader_mps,
                           double* gap_m_out) {
  *gap_m_out = kFar;
  const Point forward{std::cos(follower.heading_rad), std::sin(follower.heading_rad)};
  const Point apart{leader.x_m - follower.x_m, leader.y_m - follower.y_m};
  const double turned = std::abs(wrapped(leader.heading_rad - follower.heading_rad));
  const double cos = std::abs(std::cos(turned)), sin = std::abs(std::sin(turned));
  const double leader_reach = (cos * leader.length_m + sin * leader.width_m) / 2;
  const double leader_half_width = (sin * leader.length_m + cos * leader.width_m) / 2;
  const double gap_m = dot(apart, forward) - follower.length_m / 2 - leader_reach;
  const double overlap_m = follower.width_m / 2 + leader_half_width - std::abs(cross(forward, apart));
  const double allowed = overlap_m < kSmallOverlap_m ? kMaxAlignedDifference : kMaxHeadingDifference;
  if (gap_m <= 0 || overlap_m <= 0 || turned > allowed) return kMaxTimeToCollision_s;
  *gap_m_out = gap_m;
  const double closing_mps = follower_mps - leader_mps;
  return closing_mps > 0 ? std::min(gap_m / closing_mps, kMaxTimeToCollision_s) : kMaxTimeToCollision_s;
}

double RealismRoad::edge_distance_m(double x_m, double y_m, double z_m) const {
  const Vec3 place{static_cast<float>(x_m), static_cast<float>(y_m), static_cast<float>(z_m)};
  const RoadSide side = road_side(sides_.edges, sides_.cells.view(), place);
  if (side.edge < 0) return -static_cast<double>(kRoadSideReach_m);
  const Point place_m{x_m, y_m};
  const PlaneEdge edge(sides_.edges[static_cast<size_t>(side.edge)]);
  const Point from_a = place_m - edge.a;
  const double t = std::clamp(dot(from_a, edge.way) / std::max(dot(edge.way, edge.way), 1e-12), 0.0, 1.0);
  bool is_on_road = edge.has_on_road_side(place_m);
  const int32_t neighbor = t <= 0 ? edge.before : t >= 1 ? edge.next : -1;
  if (neighbor >= 0) {
    // Two edges meet at a corner. If they turn away from the road, a point on the road side of either edge is on the
    // road. If they turn towards the road, a point on the road must be on the road side of both edges.
    const PlaneEdge other(sides_.edges[static_cast<size_t>(neighbor)]);
    const double turn = t <= 0 ? cross(other.way, edge.way) : cross(edge.way, other.way);
    if (other.has_on_road_side(place_m) != is_on_road) is_on_road = turn > 0;
  }
  const double distance_m = std::hypot(from_a.x - t * edge.way.x, from_a.y - t * edge.way.y);
  return is_on_road ? -distance_m : distance_m;
}

double RealismRoad::edge_distance_m(const RealismObject& object, const RealismPose& pose) const {
  const double cos = std::cos(pose.heading_rad), sin = std::sin(pose.heading_rad);
  double outermost = -kFar;
  for (const double along : {-object.length_m / 2, object.length_m / 2}) {
    for (const double across : {-object.width_m / 2, object.width_m / 2}) {
      outermost =
          std::max(outermost, edge_distance_m(pose.x_m + along * cos - across * sin,
                                              pose.y_m + along * sin + across * cos, pose.z_m - object.height_m / 2));
    }
  }
  return outermost;
}

bool RealismRoad::runs_red_light(const RealismObject& object, const RealismPose& from, const RealismPose& to,
                                 int32_t step) const {
  if (step >= scenario_.num_steps) return false;
  const auto front_of = [&object](const RealismPose& pose) {
    return Point{pose.x_m + object.length_m / 2 * std::cos(pose.heading_rad),
                 pose.y_m + object.length_m / 2 * std::sin(pose.heading_rad)};
  };
  const Point start = front_of(from), way = front_of(to) - start;
  const double foot_m = to.z_m - object.height_m / 2;
  bool crosses = false;
  for (size_t i = 0; i < scenario_.lights.size(); ++i) {
    const RecordedLight& light = scenario_.lights[i];
    const RecordedLightState state = scenario_.states_of_light(static_cast<int32_t>(i))[step];
    if (state == RecordedLightState::none) continue;
    if (std::abs(wrapped(to.heading_rad - static_cast<double>(light.stop_heading_rad))) > kLineHeading) continue;
    if (std::abs(foot_m - static_cast<double>(light.stop_a_m.z)) > kLineHeight_m) continue;
    const Point a{static_cast<double>(light.stop_a_m.x), static_cast<double>(light.stop_a_m.y)};
    const Point line = Point{static_cast<double>(light.stop_b_m.x), static_cast<double>(light.stop_b_m.y)} - a;
    // `a` is the left end of the line, so the cross product is negative on the side from which traffic comes.
    const double before = cross(line, start - a), after = before + cross(line, way);
    if (!(before < 0 && after >= 0)) continue;
    const double along =
        dot(Point{start.x + way.x * before / (before - after), start.y + way.y * before / (before - after)} - a, line);
    if (along < 0 || along > dot(line, line)) continue;
    if (state != RecordedLightState::stop && state != RecordedLightState::arrow_stop) return false;
    crosses = true;
  }
  return crosses;
}

RealismFeatures::RealismFeatures(size_t num_objects, size_t num_steps)
    : num_objects_(num_objects),
      num_steps_(num_steps),
      values_(num_objects * kNumRealismFeatures * num_steps, kUndefined) {}

std::vector<double> central_differences(Span<const double> values, double dt_s, bool are_angles) {
  std::vector<double> rates(values.size(), kUndefined);
  for (size_t i = 1; i + 1 < values.size(); ++i) {
    const double change = values[i + 1] - values[i - 1];
    rates[i] = (are_angles ? wrapped(change) : change) / (2 * dt_s);
  }
  return rates;
}

RealismFeatures realism_features(const std::vector<RealismObject>& objects, const std::vector<size_t>& scored,
                                 Span<const RealismPose> poses, const RealismRoad& road, int32_t first_step,
                                 double dt_s) {
  const size_t num_poses = objects.empty() ? 0 : poses.size() / objects.size();
  const size_t num_steps = num_poses - std::min(num_poses, kRealismHistory);
  const auto poses_of = [&](size_t object) { return poses.subspan(object * num_poses, num_poses); };
  std::vector<std::vector<double>> speeds;
  for (size_t object = 0; object < objects.size(); ++object) speeds.push_back(speeds_mps(poses_of(object), dt_s));

  RealismFeatures features(scored.size(), num_steps);
  for (size_t i = 0; i < scored.size(); ++i) {
    const size_t self = scored[i];
    const RealismObject& object = objects[self];
    const Span<const RealismPose> own = poses_of(self);
    std::vector<double> headings;
    for (const RealismPose& pose : own) headings.push_back(pose.is_valid ? pose.heading_rad : kUndefined);
    const auto set = [&](RealismFeature feature, const std::vector<double>& values) {
      const Span<double> out = features.of(i, feature);
      for (size_t step = 0; step < num_steps; ++step) out[step] = values[step + kRealismHistory];
    };
    const std::vector<double> turn_rates = central_differences(headings, dt_s, /*are_angles=*/true);
    set(RealismFeature::speed, speeds[self]);
    set(RealismFeature::acceleration, central_differences(speeds[self], dt_s));
    set(RealismFeature::turn_rate, turn_rates);
    set(RealismFeature::turn_acceleration, central_differences(turn_rates, dt_s));

    for (size_t step = 0; step < num_steps; ++step) {
      const size_t at = step + kRealismHistory;
      const RealismPose& pose = own[at];
      if (!pose.is_valid) continue;
      const RealismBox box = box_of(object, pose);
      const double reach_m = std::hypot(box.length_m, box.width_m) / 2;
      double nearest_m = kFar, nearest_ahead_m = kFar, time_s = kMaxTimeToCollision_s;
      for (size_t other = 0; other < objects.size(); ++other) {
        const RealismPose& its_pose = poses[other * num_poses + at];
        if (other == self || !its_pose.is_valid) continue;
        const RealismBox its_box = box_of(objects[other], its_pose);
        const double its_reach_m = std::hypot(its_box.length_m, its_box.width_m) / 2;
        if (std::hypot(its_box.x_m - box.x_m, its_box.y_m - box.y_m) - reach_m - its_reach_m < nearest_m) {
          nearest_m = std::min(nearest_m, rounded_box_distance_m(box, its_box));
        }
        if (!object.is_vehicle) continue;
        double gap_m = kFar;
        const double its_time_s = time_to_collision_s(box, speeds[self][at], its_box, speeds[other][at], &gap_m);
        if (gap_m < nearest_ahead_m) {
          nearest_ahead_m = gap_m;
          time_s = its_time_s;
        }
      }
      const double edge_m = road.edge_distance_m(object, pose);
      features.of(i, RealismFeature::nearest_object)[step] = nearest_m;
      features.of(i, RealismFeature::collision)[step] = nearest_m < 0;
      features.of(i, RealismFeature::road_edge)[step] = edge_m;
      features.of(i, RealismFeature::off_road)[step] = edge_m > 0;
      if (!object.is_vehicle) continue;
      features.of(i, RealismFeature::time_to_collision)[step] = time_s;
      const RealismPose& before = own[at - 1];
      features.of(i, RealismFeature::red_light)[step] =
          before.is_valid && road.runs_red_light(object, before, pose, first_step + static_cast<int32_t>(step));
    }
  }
  return features;
}

}  // namespace pictura
