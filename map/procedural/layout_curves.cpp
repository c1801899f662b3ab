// Curves of streets: the headings of arms, the extent of junctions, and the curves between junctions. The mouth of a
// street is its end at a junction.
#include <algorithm>

#include "pictura/common/error.h"
#include "pictura/map/procedural/layout.h"
#include "pictura/map/procedural/movements.h"
#include "pictura/map/procedural/roundabout_shape.h"

namespace pictura::town {

namespace {

constexpr double degrees(double angle) { return angle * kPi_rad / 180; }

// Minimum angles between arms: at nodes with grid streets only, between opposite arms, and at nodes with a diagonal.
constexpr double kMinGap_rad = degrees(72), kMinOppositeGap_rad = degrees(150), kMinFiveArmGap_rad = degrees(62);
// Angle above which neighbouring arms meet without a corner.
constexpr double kFlatGap_rad = degrees(140);
constexpr double kMinMouth_m = 9, kMinBendMouth_m = 10;
// Minimum distance between the mouths of a street. Greater distances would change the towns of some seeds.
constexpr double kMinStreet_m = 3;
constexpr double kOverpassMargin_m = 2;
// Radii of the inner edge of a bend.
constexpr double kBendRadius_m = 10, kMotorwayBendRadius_m = 90;
// Distances from a fork's node to the motorway's mouth before the ramps, and to the mouths where the ramps have left
// it.
constexpr double kForkBefore_m = 10, kForkBeyond_m = 40;
constexpr double kSlipRadius_m = 16;
// Minimum lengths between the mouths of streets with a slip lane, and of streets that a slip lane leads into. Minimum
// radius of streets with a slip lane, because the lane would open abruptly on the inside of a sharper curve.
constexpr double kMinSlipStreet_m = 42, kMinSlipExit_m = 25, kMinSlipStreetRadius_m = 60;

double side_width_m(const Street& street) {
  return lane_offset_m(street, street.lanes) + kShoulderWidth_m + (street.has_sidewalks ? kSidewalkWidth_m : 0);
}

}  // namespace

double right_turn_radius_m(double gap_rad, double lane_width_m) {
  constexpr double kMin_m = 7.5, kMax_m = 12, kOverlap = 0.95;
  return std::clamp(kOverlap * lane_width_m / (1 - std::sin(0.5 * gap_rad)), kMin_m, kMax_m);
}

void Layout::set_arm_heading(int street, bool at_start, double heading) {
  Street& s = streets_[street];
  (at_start ? s.leave : s.arrive) = at_start ? heading : heading + kPi_rad;
  for (Arm& arm : nodes_[at_start ? s.from : s.to].arms) {
    if (arm.street == street && arm.at_start == at_start) arm.heading = heading;
  }
}

void Layout::set_headings() {
  for (int s = 0; s < static_cast<int>(streets_.size()); ++s) {
    const Node &from = nodes_[streets_[s].from], &to = nodes_[streets_[s].to];
    const Eigen::Vector2d apart = to.position_m - from.position_m;
    // A ramp is parallel to its motorway at both ends. One of its two directions is that of the motorway, and is even.
    const int along = streets_[s].direction % 2 == 0 ? streets_[s].direction : opposite(streets_[s].end_direction);
    const double heading =
        streets_[s].kind == StreetKind::ramp ? degrees(45.0 * along) : std::atan2(apart.y(), apart.x());
    set_arm_heading(s, true, heading);
    set_arm_heading(s, false, heading + kPi_rad);
  }
  for (Node& node : nodes_) {
    const bool has_diagonal =
        std::any_of(node.arms.begin(), node.arms.end(), [](const Arm& arm) { return arm.direction % 2 == 1; });
    if (has_diagonal && node.kind != NodeKind::fork) spread_arms(&node);
  }
}

/// Rotates the arms of a node with a diagonal until all neighbouring arms have the minimum angle between them.
void Layout::spread_arms(Node* node) {
  const int count = node->degree();
  const double min_gap = std::min(kMinFiveArmGap_rad, 0.97 * 2 * kPi_rad / count);
  constexpr int kSweeps = 200;
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    for (int i = 0; i < count; ++i) {
      const Arm a = node->arm(i), b = node->arm(i + 1);
      const double missing = min_gap - wrap_to_2pi(b.heading - a.heading);
      if (missing <= 0) continue;
      set_arm_heading(a.street, a.at_start, a.heading - 0.5 * missing);
      set_arm_heading(b.street, b.at_start, b.heading + 0.5 * missing);
    }
  }
}

bool Layout::has_close_arms(const Node& node) const {
  for (int i = 0; i < node.degree(); ++i) {
    for (int j = 0; j < i; ++j) {
      const Arm &a = node.arm(i), &b = node.arm(j);
      const double min_gap = opposite(a.direction) == b.direction ? kMinOppositeGap_rad : kMinGap_rad;
      if (std::abs(wrap_to_pi(a.heading - b.heading)) < min_gap) return true;
    }
  }
  return false;
}

/// Curves streets one by one, into an arc or an S, as far as the neighbouring arms at both ends allow.
void Layout::curve_streets() {
  std::vector<int> candidates;
  for (int s = 0; s < static_cast<int>(streets_.size()); ++s) {
    bool may_bend = streets_[s].kind == StreetKind::street || streets_[s].kind == StreetKind::avenue;
    for (const int n : {streets_[s].from, streets_[s].to}) {
      may_bend = may_bend && nodes_[n].kind != NodeKind::overpass;
      for (const Arm& arm : nodes_[n].arms) may_bend = may_bend && arm.direction % 2 == 0;
    }
    if (may_bend) candidates.push_back(s);
  }
  for (const int s : pick(options_.curved, candidates, kCurved)) {
    const Node &from = nodes_[streets_[s].from], &to = nodes_[streets_[s].to];
    const double straight = streets_[s].leave;
    RandomStream stream = draw(kCurveShape, s);
    double angle = (stream.below(2) ? 1 : -1) * static_cast<double>(stream.uniform(0.16f, 0.4f));
    constexpr float kArcShare = 0.6f;  // share of arcs among arcs and S-curves
    const double arrive_sign = stream.uniform() < kArcShare ? -1 : 1;
    for (;; angle *= 0.7) {
      if (std::abs(angle) < 0.05) angle = 0;
      set_arm_heading(s, true, straight + angle);
      set_arm_heading(s, false, straight + arrive_sign * angle + kPi_rad);
      if (angle == 0) break;
      if (has_close_arms(from) || has_close_arms(to) || !fits_between_mouths(streets_[s])) continue;
      if (max_curvature(curve_of(streets_[s])) <= 1 / kMinStreetRadius_m) break;
    }
  }
}

/// Changes roundabouts into crossings, which are smaller, where a street is shorter than the mouths at its ends.
void Layout::remove_large_roundabouts() {
  for (const Street& street : streets_) {
    const auto mouth_of_roundabout_m = [&](int node) {
      return nodes_[node].kind == NodeKind::roundabout ? mouth_distance_m(street, node) : 0;
    };
    while (!fits_between_mouths(street)) {
      const int larger =
          mouth_of_roundabout_m(street.to) > mouth_of_roundabout_m(street.from) ? street.to : street.from;
      if (nodes_[larger].kind != NodeKind::roundabout) break;
      nodes_[larger].kind = NodeKind::crossing;
    }
  }
}

/// Returns the distance from the node to the mouth of an arm. The corners with the two neighbouring arms determine it.
double Layout::mouth_distance_m(const Node& node, int index) const {
  const Arm& arm = node.arm(index);
  const Street& street = streets_[arm.street];
  if (node.kind == NodeKind::overpass) {
    return std::max(side_width_m(streets_[node.arm(index + 1).street]),
                    side_width_m(streets_[node.arm(index - 1).street])) +
           kOverpassMargin_m;
  }
  if (node.is_bend()) {
    const double radius = street.kind == StreetKind::motorway ? kMotorwayBendRadius_m : kBendRadius_m;
    const double gap = std::abs(wrap_to_pi(node.arm(index + 1).heading - arm.heading));
    return std::max(kMinBendMouth_m, (side_width_m(street) + radius) / std::tan(0.5 * gap));
  }
  if (node.kind == NodeKind::fork) {
    const bool is_before = street.lanes == max_lanes_of(node);
    return is_before ? kForkBefore_m : kForkBeyond_m;
  }
  if (node.kind == NodeKind::roundabout) {
    const double edge_m = circle_edge_m(max_lanes_of(node), street.lanes);
    double mouth = 0;
    for (const int side : {1, -1}) {
      const double gap = wrap_to_2pi(side * (node.arm(index + side).heading - arm.heading));
      mouth = std::max(mouth, roundabout_mouth_m(roundabout_half_angle(gap), edge_m));
    }
    return mouth;
  }
  double mouth = kMinMouth_m;
  for (const int side : {1, -1}) {  // the left neighbour, then the right one, as seen from the node
    const Arm& left = side > 0 ? node.arm(index + 1) : arm;
    const Arm& right = side > 0 ? arm : node.arm(index - 1);
    const double gap = wrap_to_2pi(left.heading - right.heading);
    if (gap > kFlatGap_rad) continue;
    // Traffic that arrives on the right arm turns right into the left arm. Its path begins on the left border of the
    // right arm's outermost lane, and ends on the left border of the left arm's outermost lane.
    const Street &in = streets_[right.street], &out = streets_[left.street];
    const double in_offset = lane_offset_m(in, in.lanes - (has_slip(right) ? 0 : 1));
    const double out_offset = lane_offset_m(out, out.lanes - 1);
    const double own = side > 0 ? in_offset : out_offset, other = side > 0 ? out_offset : in_offset;
    const double radius = has_slip(right) ? kSlipRadius_m : right_turn_radius_m(gap, lane_width_m_);
    mouth = std::max(mouth, (other + own * std::cos(gap)) / std::sin(gap) + radius / std::tan(0.5 * gap));
  }
  return mouth;
}

double Layout::mouth_distance_m(const Street& street, int node) const {
  int index = 0;
  while (&streets_[nodes_[node].arms[index].street] != &street) ++index;
  return mouth_distance_m(nodes_[node], index);
}

/// Returns the poses of the mouths at both ends of a street, both in the street's direction.
std::pair<Pose, Pose> Layout::ends_of(const Street& street) const {
  const Pose from{nodes_[street.from].position_m, street.leave}, to{nodes_[street.to].position_m, street.arrive};
  return {offset_right(moved_forward(from, mouth_distance_m(street, street.from)), street.start_offset_m),
          offset_right(moved_forward(to, -mouth_distance_m(street, street.to)), street.end_offset_m)};
}

/// Whether the way between the mouths of a street is at least kMinStreet_m long in the direction of both mouths.
bool Layout::fits_between_mouths(const Street& street) const {
  const auto [from, to] = ends_of(street);
  const Eigen::Vector2d way = to.position_m - from.position_m;
  return way.dot(direction_of(from.heading)) >= kMinStreet_m && way.dot(direction_of(to.heading)) >= kMinStreet_m;
}

Curve Layout::curve_of(const Street& street) const {
  const auto [from, to] = ends_of(street);
  return biarc(from, to);
}

/// Chooses slip lanes among the right turns at lights where both streets are long enough for the larger corner.
void Layout::choose_slip_lanes() {
  struct Turn {
    int node, arm;
  };
  std::vector<Turn> turns;
  std::vector<int> candidates;
  for (int n = 0; n < static_cast<int>(nodes_.size()); ++n) {
    const Node& node = nodes_[n];
    const bool has_diagonal =
        std::any_of(node.arms.begin(), node.arms.end(), [](const Arm& arm) { return arm.direction % 2 == 1; });
    if (!node.is_crossing() || !node.has_lights || has_diagonal || has_ramps(n)) continue;
    for (int i = 0; i < node.degree(); ++i) {
      // The stem of a T needs its lanes for both turns, and a street that narrows needs its outermost lane for right
      // turns.
      const int straight = straight_on(node, i), lanes = streets_[node.arm(i).street].lanes;
      if (lanes > (straight < 0 ? 1 : streets_[node.arm(straight).street].lanes)) continue;
      if (wrap_to_2pi(node.arm(i + 1).heading - node.arm(i).heading) > degrees(115)) continue;
      candidates.push_back(static_cast<int>(turns.size()));
      turns.push_back({n, i});
    }
  }
  auto wanted = pick(options_.slip_lanes, candidates, kSlipLanes).size();
  for (const int candidate : shuffled(candidates, kSlipLanes)) {
    if (wanted == 0) break;
    const Node& node = nodes_[turns[candidate].node];
    const Arm &in = node.arm(turns[candidate].arm), &out = node.arm(turns[candidate].arm + 1);
    Street &street = streets_[in.street], &exit = streets_[out.street];
    bool& slip = in.at_start ? street.slip_at_start : street.slip_at_end;
    slip = true;
    slip = fits_between_mouths(street) && fits_between_mouths(exit);
    if (!slip) continue;
    Curve in_curve = curve_of(street), out_curve = curve_of(exit);
    const int ends = (street.slip_at_start ? 1 : 0) + (street.slip_at_end ? 1 : 0);
    const int exit_ends = (exit.slip_at_start ? 1 : 0) + (exit.slip_at_end ? 1 : 0);
    slip = max_curvature(in_curve) <= 1 / kMinSlipStreetRadius_m &&
           max_curvature(out_curve) <= 1 / kMinStreetRadius_m &&
           assign_stations(&in_curve) >= ends * kMinSlipStreet_m &&
           assign_stations(&out_curve) >= std::max(kMinSlipExit_m, exit_ends * kMinSlipStreet_m);
    if (slip) --wanted;
  }
}

void Layout::build_curves() {
  for (Node& node : nodes_) {
    for (int i = 0; i < node.degree(); ++i) node.arms[i].mouth_m = mouth_distance_m(node, i);
  }
  for (Street& street : streets_) {
    if (!fits_between_mouths(street)) {
      const Eigen::Vector2d &from = nodes_[street.from].position_m, &to = nodes_[street.to].position_m;
      fail_usage(
          "procedural town: expected at least {} m of street between the crossings at ({:.1f}, {:.1f}) and ({:.1f}, "
          "{:.1f}), got less; increase block-m, or decrease max-lanes",
          kMinStreet_m, from.x(), from.y(), to.x(), to.y());
    }
    street.curve = curve_of(street);
    street.length_m = assign_stations(&street.curve);
  }
}

}  // namespace pictura::town
