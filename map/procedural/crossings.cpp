// Builds junctions of three to five arms: one connecting road per movement, corners with sidewalks, and crosswalks.
#include "pictura/map/procedural/town_builder.h"

namespace pictura::town {

namespace {

constexpr double kMaxTurnRadius_m = 14;  // radius of the left border of all turns except right turns
// Additional width in the middle of lanes that turn across the junction, so that no gap remains between adjacent lanes.
constexpr double kTurningExtra_m = 0.5;
constexpr double kCrosswalkBegin_m = 0.6, kCrosswalkEnd_m = 3.4;  // distance beyond the stop line

}  // namespace

void TownBuilder::build_crossing(const Node& node) {
  opendrive::FileJunction junction;
  junction.id = next_id();
  for (const Arm& arm : node.arms) set_junction_link(end_of(arm), junction.id);
  const std::vector<Movement> movements = movements_of(layout_, node);
  std::vector<int> roads;
  for (const Movement& movement : movements) roads.push_back(build_movement(node, movement, &junction));
  if (node.has_crosswalks) {
    for (std::size_t i = 0; i < movements.size(); ++i) {
      if (i == 0 || movements[i].from != movements[i - 1].from) add_crosswalk(node.arm(movements[i].from), roads[i]);
    }
  }
  if (node.has_lights) add_lights(node, movements, roads, &junction);
  finish_junction(std::move(junction));
}

int TownBuilder::build_movement(const Node& node, const Movement& movement, opendrive::FileJunction* junction) {
  const Arm &from = node.arm(movement.from), &to = node.arm(movement.to);
  const Street &in = street_of(from), &out = street_of(to);
  const int first_in = movement.is_slip ? in.lanes : movement.first_in;
  const bool has_median = in.kind == StreetKind::motorway && out.kind == StreetKind::motorway;
  const Pose start = offset_right(reversed(mouth_of(node, from)), has_median ? 0 : lane_offset_m(in, first_in));
  const Pose end = offset_right(mouth_of(node, to), has_median ? 0 : lane_offset_m(out, movement.first_out));
  // A right turn into the next arm has a corner. Its sidewalk follows the outermost lane.
  const bool turns_right = movement.to == (movement.from + 1) % node.degree();
  const int in_lanes = in.lanes + (layout_.has_slip(from) ? 1 : 0);
  const bool has_corner =
      turns_right && first_in + movement.lanes == in_lanes && movement.first_out + movement.lanes == out.lanes;
  const bool is_straight = straight_on(node, movement.from) == movement.to;
  const double radius = movement.is_slip ? kNoRadiusLimit_m
                        : turns_right    ? right_turn_radius_m(wrap_to_2pi(to.heading - from.heading), in.lane_width_m)
                                         : kMaxTurnRadius_m;
  const bool is_fork = node.kind == NodeKind::fork;
  const double speed = is_straight || is_fork ? speed_mps(in.kind) : kJunctionSpeed_mps;
  const Side right{.driving = movement.lanes,
                   .has_median = has_median,
                   .has_shoulder = has_corner,
                   .has_sidewalk = has_corner && in.has_sidewalks && out.has_sidewalks};
  // Lanes of a motorway are marked at its forks too.
  SectionStyle style(in.lane_width_m);
  style.in_junction = !is_fork;
  style.one_way = true;
  if (!is_straight && !has_corner) style.driving_middle_m += kTurningExtra_m;
  const int connecting = add_road(is_straight ? biarc(start, end) : fillet(start, end, radius), node.z, junction->id,
                                  speed, kNoSide, right, style);
  connect(end_of(from), connecting, end_of(to), movement, junction);
  return connecting;
}

/// Adds a crosswalk across the arm, just inside the junction, from kerb to kerb. The crosswalk belongs to `owner_road`,
/// which begins at the centre of the arm.
void TownBuilder::add_crosswalk(const Arm& arm, int owner_road) {
  const Street& street = street_of(arm);
  const double out = lane_offset_m(street, street.lanes) + kShoulderWidth_m;
  const double in = out + (layout_.has_slip(arm) ? street.lane_width_m : 0);
  opendrive::FileObject crosswalk;
  crosswalk.kind = opendrive::FileObject::Kind::crosswalk;
  crosswalk.length = kCrosswalkEnd_m - kCrosswalkBegin_m;
  crosswalk.width = in + out;
  crosswalk.outline = {{kCrosswalkBegin_m, -in, 0, false},
                       {kCrosswalkEnd_m, -in, 0, false},
                       {kCrosswalkEnd_m, out, 0, false},
                       {kCrosswalkBegin_m, out, 0, false}};
  road(owner_road).objects.push_back(std::move(crosswalk));
}

}  // namespace pictura::town
