// Traffic lights of a town: one for every approach of a crossing, each with its own controller and phase.
#include <cmath>
#include <limits>

#include "pictura/map/opendrive/curves.h"
#include "pictura/map/procedural/town_builder.h"

namespace pictura::town {

namespace {

constexpr double kPostSetback_m = 0.8;  // distance of a post from the kerb
// Near-side heads are on a post beyond the stop line, or on a mast arm over the lanes. The mast arm is high enough for
// traffic to pass below.
constexpr double kNearPost_m = 3, kNearArm_m = 4, kArmRise_m = 2;

struct SignalPosition {
  Eigen::Vector2d position_m;
  double z_offset_m = 0;
};

double behind_kerb_m(const Street& street) {
  return lane_offset_m(street, street.lanes) + kShoulderWidth_m + kPostSetback_m;
}

SignalPosition position_at(const Pose& pose, double z_offset_m = 0) { return {pose.position_m, z_offset_m}; }

/// Returns a position just beyond the stop line. It is beside the road for a single lane, and above the road for
/// several lanes.
SignalPosition near_side(const Pose& arriving, const Street& street, bool has_slip) {
  if (street.lanes == 1 && !has_slip) {
    return position_at(moved_forward(offset_right(arriving, behind_kerb_m(street)), kNearPost_m));
  }
  const double middle_m = 0.5 * lane_offset_m(street, street.lanes);
  return position_at(moved_forward(offset_right(arriving, middle_m), kNearArm_m), kArmRise_m);
}

/// Returns a position beyond the junction, behind the kerbs of the two arms on both sides of the direction of travel.
SignalPosition far_side_between(const Layout& layout, const Node& node, int arm) {
  const double forward = node.arm(arm).heading + kPi_rad;
  double nearest = 0.5 * kPi_rad;
  double kerb_m = 0;
  for (int i = 0; i < node.degree(); ++i) {
    if (i == arm) continue;
    nearest = std::min(nearest, std::abs(wrap_to_pi(node.arm(i).heading - forward)));
    kerb_m = std::max(kerb_m, behind_kerb_m(layout.streets()[node.arm(i).street]));
  }
  return position_at(moved_forward({node.position_m, forward}, kerb_m / std::sin(nearest)));
}

/// Road coordinates of a point: the station `s` of its projection onto the reference line, and its distance `t` to the
/// left of the line.
struct RoadPosition {
  double s = 0, t = std::numeric_limits<double>::infinity();
};

RoadPosition project_onto(const opendrive::FileRoad& road, const SignalPosition& position) {
  constexpr int kStarts = 8, kSteps = 30;
  constexpr double kConverged_m = 1e-6;
  RoadPosition best;
  for (int start = 0; start <= kStarts; ++start) {
    double s = road.length * start / kStarts;
    for (int step = 0; step < kSteps; ++step) {
      const opendrive::Pose pose = opendrive::pose_at(road, s);
      const Eigen::Vector2d apart = position.position_m - pose.position_m, forward = direction_of(pose.heading);
      const double along = apart.dot(forward);
      const double left = cross_of(forward, apart);
      if (std::abs(along) < kConverged_m && std::abs(left) < std::abs(best.t)) best = {s, left};
      s = std::clamp(s + along / std::max(0.2, 1 - pose.curvature * left), 0.0, road.length);
    }
  }
  return best;
}

}  // namespace

void TownBuilder::add_lights(const Node& node, const std::vector<Movement>& movements, const std::vector<int>& roads,
                             opendrive::FileJunction* junction) {
  for (int i = 0; i < node.degree(); ++i) {
    const Arm& arm = node.arm(i);
    if (!arm.has_arrivals) continue;
    const int straight = straight_on(node, i);
    SignalPosition position = near_side(reversed(mouth_of(node, arm)), street_of(arm), layout_.has_slip(arm));
    if (node.far_side_heads && straight >= 0) {
      const Arm& exit = node.arm(straight);
      position = position_at(offset_right(mouth_of(node, exit), behind_kerb_m(street_of(exit))));
    } else if (node.far_side_heads) {
      position = far_side_between(layout_, node, i);
    }
    // The signal is attached to the closest connecting road.
    int owner_road = roads[0];
    RoadPosition projection;
    for (const int candidate : roads) {
      const RoadPosition other = project_onto(road(candidate), position);
      if (std::abs(other.t) >= std::abs(projection.t)) continue;
      projection = other;
      owner_road = candidate;
    }
    opendrive::FileSignal signal;
    signal.id = next_id();
    signal.type = "1000001";
    signal.subtype = "-1";
    signal.country = "OpenDRIVE";
    signal.is_dynamic = true;
    signal.s = projection.s;
    signal.t = projection.t;
    signal.z_offset = position.z_offset_m;
    for (std::size_t m = 0; m < movements.size(); ++m) {
      if (movements[m].from != i || movements[m].is_slip) continue;
      opendrive::SignalReference reference;
      reference.signal = signal.id;
      reference.validity = {{-movements[m].lanes, -1}};
      road(roads[m]).signal_references.push_back(std::move(reference));
    }
    opendrive::FileController controller;
    controller.id = next_id();
    controller.sequence = i;
    controller.signals.push_back(signal.id);
    junction->controllers.push_back(controller.id);
    network_.controllers.push_back(std::move(controller));
    road(owner_road).signals.push_back(std::move(signal));
  }
}

}  // namespace pictura::town
