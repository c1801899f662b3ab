// What the realism score compares between recorded and simulated road users: motion, nearness, time to collision, road
// edges and red lights, step by step. docs/explanation/realism.md has the definitions and their sources. Without torch
// headers.
#pragma once

#include <cstdint>
#include <vector>

#include "pictura/common/span.h"
#include "pictura/map/scenario/drivable_area.h"
#include "pictura/map/scenario/scenario.h"

namespace pictura {

enum class RealismFeature : uint8_t {
  speed,              // m/s, in three dimensions
  acceleration,       // m/s^2, of the speed
  turn_rate,          // rad/s
  turn_acceleration,  // rad/s^2
  nearest_object,     // m, to the nearest other road user; negative: overlap
  collision,          // 0 or 1
  time_to_collision,  // s, of vehicles, behind what they follow
  road_edge,          // m, of the outermost corner; positive: off the road
  off_road,           // 0 or 1
  red_light,          // 0 or 1, of vehicles
};
constexpr size_t kNumRealismFeatures = 10;
/// "linear_speed", "linear_acceleration", "angular_speed", ...: the names in reports.
const char* to_string(RealismFeature feature);

/// A box's centre, in metres of the map.
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

/// Metres between two boxes whose corners are rounded by kCornerRounding of half of the shorter side; negative: how far
/// one must move at least until they only touch.
double rounded_box_distance_m(const RealismBox& a, const RealismBox& b);
constexpr double kCornerRounding = 0.7;

/// Seconds until `follower` reaches `leader` at constant speeds, where it follows it: the leader's box is ahead in the
/// follower's frame and overlaps it laterally, and their headings differ by at most 75 degrees, by at most 10 where the
/// overlap is below 0.5 m. gap_m_out receives the distance along the follower's heading, infinity where it follows
/// nothing. At most kMaxTimeToCollision_s, also where the gap does not close or a speed is NaN.
double time_to_collision_s(const RealismBox& follower, double follower_mps, const RealismBox& leader, double leader_mps,
                           double* gap_m_out);
constexpr double kMaxTimeToCollision_s = 5.0;

/// The map of a scene, and its lights, as features ask for them.
class RealismRoad {
 public:
  explicit RealismRoad(const Scenario& scenario) : sides_(side_edges_of(scenario.map)), scenario_(scenario) {}

  /// Horizontal metres from a place to the nearest edge of its level; positive: off the road. Within
  /// +-kRoadSideReach_m.
  double edge_distance_m(double x_m, double y_m, double z_m) const;
  /// The distance of the outermost of a box's four lower corners.
  double edge_distance_m(const RealismObject& object, const RealismPose& pose) const;
  /// Whether the middle of a box's front crosses, from one pose to the next, stop lines in their direction of travel
  /// whose lights are all red at that step of the recording. Heights within 2 m of the line, headings within 45
  /// degrees.
  bool runs_red_light(const RealismObject& object, const RealismPose& from, const RealismPose& to, int32_t step) const;

 private:
  SideEdges sides_;
  const Scenario& scenario_;  // must live as long
};

/// Features of some objects of a scene: [objects][kNumRealismFeatures][steps]; NaN where a step has none.
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

/// Steps before the first one with features, from which its speeds and accelerations come.
constexpr size_t kRealismHistory = 2;

/// Derivatives by central differences over two steps of dt_s; [steps] NaN where one of the two is not there.
std::vector<double> central_differences(Span<const double> values, double dt_s, bool are_angles = false);

/// The features of objects[scored[i]] among all objects. poses: [objects][kRealismHistory + steps], of which the pose
/// kRealismHistory is at the step first_step of the recording.
RealismFeatures realism_features(const std::vector<RealismObject>& objects, const std::vector<size_t>& scored,
                                 Span<const RealismPose> poses, const RealismRoad& road, int32_t first_step,
                                 double dt_s);

}  // namespace pictura
