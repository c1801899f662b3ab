// Features by which the realism score compares simulated with recorded road users at each step: motion, distances, time
// to collision, road edges and red lights. docs/explanation/realism.md has the definitions and their sources. Includes
// no torch headers.
#pragma once

#include <cstdint>
#include <vector>

#include "pictura/common/span.h"
#include "pictura/map/scenario/drivable_area.h"
#include "pictura/map/scenario/scenario.h"

namespace pictura {

enum class RealismFeature : uint8_t {
  speed,              // m/s, in three dimensions
  acceleration,       // m/s^2, derivative of the speed
  turn_rate,          // rad/s
  turn_acceleration,  // rad/s^2
  nearest_object,     // m, to the nearest other road user; negative: overlap
  collision,          // 0 or 1
  time_to_collision,  // s, to the road user that a vehicle follows; vehicles only
  road_edge,          // m, from the road edge to the box's outermost corner; positive: off the road
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

/// Returns the distance in metres between two boxes with rounded corners. The radius of a box's corners is
/// kCornerRounding times half its shorter side. If the boxes overlap, returns the negative of the smallest shift that
/// separates them.
double rounded_box_distance_m(const RealismBox& a, const RealismBox& b);
constexpr double kCornerRounding = 0.7;

/// Returns the seconds until `follower` reaches `leader` at constant speeds. The follower follows the leader if the
/// leader's box is ahead of the follower's box and overlaps it laterally, and if the headings differ by at most 75
/// degrees (10 degrees if the overlap is below 0.5 m). gap_m_out receives the gap between both boxes along the
/// follower's heading; infinity if the follower does not follow the leader. The maximum result is
/// kMaxTimeToCollision_s. The function also returns this maximum if the follower does not follow the leader, the gap
/// does not close, or a speed is NaN.
double time_to_collision_s(const RealismBox& follower, double follower_mps, const RealismBox& leader, double leader_mps,
                           double* gap_m_out);
constexpr double kMaxTimeToCollision_s = 5.0;

/// Road edges and traffic lights of a scene, prepared for the computation of features.
class RealismRoad {
 public:
  explicit RealismRoad(const Scenario& scenario) : sides_(side_edges_of(scenario.map)), scenario_(scenario) {}

  /// Returns the horizontal distance in metres from a place to the nearest road edge on the same level; positive: off
  /// the road. If no edge is within kRoadSideReach_m, returns -kRoadSideReach_m.
  double edge_distance_m(double x_m, double y_m, double z_m) const;
  /// Returns the maximum edge distance of the four lower corners of a box.
  double edge_distance_m(const RealismObject& object, const RealismPose& pose) const;
  /// Returns whether the middle of a box's front crosses a stop line between two poses, in the line's direction of
  /// travel, while the line's light is red. The recording at `step` defines the lights. If the box crosses several
  /// lines in one step, all their lights must be red. A line is ignored if the box is more than 2 m above or below it,
  /// or heads more than 45 degrees away from the line's direction.
  bool runs_red_light(const RealismObject& object, const RealismPose& from, const RealismPose& to, int32_t step) const;

 private:
  SideEdges sides_;
  const Scenario& scenario_;  // must outlive this object
};

/// Features of some objects of a scene: [objects][kNumRealismFeatures][steps]; NaN if a feature is undefined at a step.
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

/// Number of poses before the first step with features. The speed and acceleration at that step depend on these poses.
constexpr size_t kRealismHistory = 2;

/// Returns derivatives [steps] by central differences over two steps of dt_s; NaN at steps with a missing neighbour.
std::vector<double> central_differences(Span<const double> values, double dt_s, bool are_angles = false);

/// Returns the features of objects[scored[i]] for each i. Distances and times to collision consider all objects. poses:
/// [objects][kRealismHistory + steps]; index kRealismHistory of the second axis is step first_step of the recording.
RealismFeatures realism_features(const std::vector<RealismObject>& objects, const std::vector<size_t>& scored,
                                 Span<const RealismPose> poses, const RealismRoad& road, int32_t first_step,
                                 double dt_s);

}  // namespace pictura
