// Builds roundabouts: a one-way circle in pieces, and a junction at each arm. Each junction has three connecting roads:
// one along the circle, the exit and the entry.
#include "pictura/map/procedural/roundabout_shape.h"
#include "pictura/map/procedural/town_builder.h"

namespace pictura::town {

namespace {

/// Returns a pose on a circle around the node, in the direction of traffic.
Pose on_circle(const Node& node, double radius_m, double angle) {
  return {node.position_m + radius_m * direction_of(angle), angle + 0.5 * kPi_rad};
}

Curve circle_piece(const Node& node, double radius_m, double from_angle, double turn) {
  return {piece_of(on_circle(node, radius_m, from_angle), turn * radius_m, 1 / radius_m)};
}

}  // namespace

void TownBuilder::build_roundabout(const Node& node) {
  const int count = node.degree(), lanes = layout_.max_lanes_of(node);
  const double radius = circle_radius_m(lanes);
  const auto gap_after = [&](int arm) { return wrap_to_2pi(node.arm(arm + 1).heading - node.arm(arm).heading); };
  const auto entry_angle = [&](int arm) { return node.arm(arm).heading + roundabout_half_angle(gap_after(arm)); };
  const auto exit_angle = [&](int arm) {
    return node.arm(arm).heading - roundabout_half_angle(gap_after((arm + count - 1) % count));
  };
  const auto corner = [&](int driving, const Arm& a, const Arm& b) {
    return Side{.driving = driving, .has_sidewalk = street_of(a).has_sidewalks && street_of(b).has_sidewalks};
  };
  SectionStyle on_the_circle(kCircleLaneWidth_m);
  on_the_circle.one_way = true;
  SectionStyle inside = on_the_circle;
  inside.in_junction = true;

  std::vector<int> pieces;  // pieces of the circle; piece i follows arm i
  for (int i = 0; i < count; ++i) {
    pieces.push_back(add_road(
        circle_piece(node, radius, entry_angle(i), wrap_to_2pi(exit_angle((i + 1) % count) - entry_angle(i))), node.z,
        "", kRoundaboutSpeed_mps, kNoSide, corner(lanes, node.arm(i), node.arm(i + 1)), on_the_circle));
  }
  for (int i = 0; i < count; ++i) {
    const Arm& arm = node.arm(i);
    const int arm_lanes = street_of(arm).lanes, first = lanes - arm_lanes;
    const double edge = circle_edge_m(lanes, arm_lanes);
    const RoadEnd before{pieces[(i + count - 1) % count], false}, after{pieces[i], true};
    opendrive::FileJunction junction;
    junction.id = next_id();
    for (const RoadEnd end : {before, after, end_of(arm)}) set_junction_link(end, junction.id);
    const Side bare{.driving = lanes, .has_shoulder = false, .has_sidewalk = false};
    const int on = add_road(circle_piece(node, radius, exit_angle(i), wrap_to_2pi(entry_angle(i) - exit_angle(i))),
                            node.z, junction.id, kRoundaboutSpeed_mps, kNoSide, bare, inside);
    connect(before, on, after, {}, &junction);
    SectionStyle narrowing = inside, widening = inside;
    narrowing.driving_to_m = widening.driving_from_m = layout_.lane_width_m();
    const int exit = add_road(fillet(on_circle(node, edge, exit_angle(i)), mouth_of(node, arm), kNoRadiusLimit_m),
                              node.z, junction.id, kRoundaboutSpeed_mps, kNoSide,
                              corner(arm_lanes, node.arm(i + count - 1), arm), narrowing);
    connect(before, exit, end_of(arm), {.first_in = first}, &junction);
    const int entry =
        add_road(fillet(reversed(mouth_of(node, arm)), on_circle(node, edge, entry_angle(i)), kNoRadiusLimit_m), node.z,
                 junction.id, kRoundaboutSpeed_mps, kNoSide, corner(arm_lanes, arm, node.arm(i + 1)), widening);
    connect(end_of(arm), entry, after, {.first_out = first}, &junction);
    if (node.has_crosswalks) add_crosswalk(arm, entry);
    finish_junction(std::move(junction));
  }
}

}  // namespace pictura::town
