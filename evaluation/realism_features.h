// Features by which the realism score compares simulated and recorded road users at each step.
// docs/explanation/realism.md has definitions and sources.
#pragma once

#include <cstdint>
#include <vector>

#include "pictura/common/span.h"
#include "pictura/map/scenario/drivable_area.h"
#include "pictura/map/scenario/scenario.h"

namespace pictura {

enum class RealismFeature : uint8_t {
  speed,              // m/s, three-dimensional
  acceleration,       // m/s^2, derivative of the speed
  turn_rate,          // rad/s
  turn_acceleration,  // rad/s^2
  nearest_object,     // m; negative: overlap
  collision,          // 0 or 1
  time_to_collision,  // s, to the leader; vehicles only
  road_edge,          // m, of the box's outermost corner; positive: off the road
  off_road,           // 0 or 1
  red_light,          // 0 or 1; vehicles only
};
constexpr size_t kNumRealismFeatures = 10;
/// Name in reports: "linear_speed", "linear_acceleration", "angular_speed", ...
const char* to_string(RealismFeature feature);

/// Centre and heading of a box, in map coordinates.
struct RealismPose {
  double x_m = 0, y_m = 0, z_m = 0, heading_rad = 0;
  bool is_valid = false;
};

struct RealismObject {
  bool is_vehicle = false;
  double length_m = 0, width_m = 0, height_m = 0;
};

/// A box on the ground.
struct RealismBox {
  double x_m = 0, y_m = 0, heading_rad = 0, length_m = 0, width_m = 0;
};

/// Returns the distance in metres between boxes whose corner radius is kCornerRounding times half the shorter side.
/// Overlapping boxes give the negative of the smallest separating shift.
double rounded_box_distance_m(const RealismBox& a, const RealismBox& b);
constexpr double kCornerRounding = 0.7;

/// Returns the seconds until `follower` reaches `leader` at constant speeds, at most kMaxTimeToCollision_s. The leader
/// must be ahead, overlap laterally, and differ in heading by at most 75 degrees (10 degrees if the overlap is below
/// 0.5 m). Otherwise, or if the gap does not close or a speed is NaN, returns kMaxTimeToCollision_s. gap_m_out: gap
/// along the follower's heading; infinity without a valid leader.
double time_to_collision_s(const RealismBox& follower, double follower_mps, const RealismBox& leader, double leader_mps,
                           double* gap_m_out);
constexpr double kMaxTimeToCollision_s = 5.0;

/// Road edges and traffic lights of a scene.
class RealismRoad {
 public:
  explicit RealismRoad(const Scenario& scenario) : sides_(side_edges_of(scenario.map)), scenario_(scenario) {}

  /// Returns the horizontal distance in metres to the nearest road edge on the same level; positive: off the road.
  /// Returns -kRoadSideReach_m if no edge is that near.
  double edge_distance_m(double x_m, double y_m, double z_m) const;
  /// Returns the maximum over the four lower corners.
  double edge_distance_m(const RealismObject& object, const RealismPose& pose) const;
  /// Returns whether the middle of a box's front crosses a stop line between two poses, in the line's direction, while
  /// its light is red. The recording at `step` defines the lights. If a step crosses several lines, all their lights
  /// must be red. Ignores lines more than 2 m above or below, or more than 45 degrees off the heading.
  bool runs_red_light(const RealismObject& object, const RealismPose& from, const RealismPose& to, int32_t step) const;

 private:
  SideEdges sides_;
  const Scenario& scenario_;  // must outlive this object
};

/// [objects][kNumRealismFeatures][steps]; NaN: undefined at a step.
class RealismFeatures {
 public:
  RealismFeatures() = default;
  RealismFeatures(size_t num_objects, size_t num_steps);
  size_t num_objects() const { return num_objects_; }
  size_t num_steps() const { return num_steps_; }
  Span<double> of(size_t object, RealismFeature feature) {
    return {values_.data() + first(object, feature), num_steps_};
  }
  Span<const double> of(size_t object, RealismFeature feature) const {
    return {values_.data() + first(object, feature), num_steps_};
  }

 private:
  size_t first(size_t object, RealismFeature feature) const {
    return (object * kNumRealismFeatures + static_cast<size_t>(feature)) * num_steps_;
  }
  size_t num_objects_ = 0, num_steps_ = 0;
  std::vector<double> values_;
};

/// Number of poses that precede the first step with features.
constexpr size_t kRealismHistory = 2;

/// Returns [steps]: central differences over two steps; NaN next to a missing value.
std::vector<double> central_differences(Span<const double> values, double dt_s, bool are_angles = false);

/// Returns the features of objects[scored[i]], in relation to all objects. poses: [objects][kRealismHistory + steps];
/// index kRealismHistory is step first_step of the recording.
RealismFeatures realism_features(const std::vector<RealismObject>& objects, const std::vector<size_t>& scored,
                                 Span<const RealismPose> poses, const RealismRoad& road, int32_t first_step,
                                 double dt_s);

}  // namespace pictura
