// Builds streets and bends, and the links between the lanes of roads.
#include "pictura/map/procedural/town_builder.h"

#include <fmt/format.h>

#include "pictura/map/procedural/elevation.h"

namespace pictura::town {

namespace {

constexpr double kMinParking_m = 30;  // minimum length of a section with parking bays
constexpr double kSlipSection_m = 32, kMaxSlipFraction = 0.48;
constexpr double kSpaceLength_m = 6, kParkedLength_m = 5, kParkedWidth_m = 2;

void add_parking_spaces(opendrive::FileRoad* road, const opendrive::FileSection& section, double inner_m, bool left) {
  const double begin = section.s + kParkingLead_m + kParkingTaper_m;
  const double available_m = section.end - kParkingLead_m - kParkingTaper_m - begin;
  const double t = inner_m + 0.5 * kParkingWidth_m;
  const int spaces = static_cast<int>(available_m / kSpaceLength_m);
  for (int i = 0; i < spaces; ++i) {
    opendrive::FileObject space;
    space.kind = opendrive::FileObject::Kind::parking_space;
    space.s = begin + (i + 0.5) * available_m / spaces;
    space.t = left ? t : -t;
    space.length = kParkedLength_m;
    space.width = kParkedWidth_m;
    road->objects.push_back(std::move(space));
  }
}

}  // namespace

TownBuilder::TownBuilder(const Layout& layout) : layout_(layout) {
  for (int s = 0; s < static_cast<int>(layout.streets().size()); ++s) build_street(s);
  for (const Node& node : layout.nodes()) {
    if (node.kind == NodeKind::overpass) {
      build_bend(node, node.arm(0), node.arm(2), node.upper_runs_north ? node.z : node.upper_z);
      build_bend(node, node.arm(1), node.arm(3), node.upper_runs_north ? node.upper_z : node.z);
    } else if (node.kind == NodeKind::roundabout) {
      build_roundabout(node);
    } else if (node.is_bend()) {
      build_bend(node, node.arm(0), node.arm(1), node.z);
    } else {
      build_crossing(node);
    }
  }
  for (std::size_t i = 0; i < network_.roads.size(); ++i) {
    for (opendrive::FileObject& object : network_.roads[i].objects) object.id = next_id();
    network_.road_index.emplace(network_.roads[i].id, static_cast<int>(i));
  }
}

int TownBuilder::add_road(Curve curve, double height_m, const std::string& junction, double speed_mps, const Side& left,
                          const Side& right, const SectionStyle& style) {
  opendrive::FileRoad& added = network_.roads.emplace_back();
  added.id = fmt::format("{}", network_.roads.size() - 1);
  added.junction = junction;
  added.length = assign_stations(&curve);
  added.geometry = std::move(curve);
  added.elevation = elevation_profile(height_m, height_m, added.length);
  added.speed_limit_mps = {{{0, speed_mps, 0, 0, 0}}};
  added.sections.push_back(make_section(0, added.length, left, right, style));
  end_sides_.push_back({left, right});
  end_sides_.push_back({left, right});
  return static_cast<int>(network_.roads.size()) - 1;
}

void TownBuilder::build_street(int index) {
  const Street& street = layout_.streets()[index];
  const double length = street.length_m;
  const double slip = std::min(kSlipSection_m, kMaxSlipFraction * length);
  const double begin = street.slip_at_start ? slip : 0, end = street.slip_at_end ? length - slip : length;
  const Side plain{
      .driving = street.lanes, .has_median = street.kind == StreetKind::motorway, .has_sidewalk = street.has_sidewalks};
  const bool is_one_way = street.kind == StreetKind::ramp;
  SectionStyle style(street.lane_width_m);
  style.one_way = is_one_way;
  Side left = is_one_way ? kNoSide : plain, right = plain, with_slip = plain;
  constexpr double kRounding = 1 + 1e-9;
  const bool may_park = end - begin >= kMinParking_m && max_curvature(street.curve) <= kRounding / kMinStreetRadius_m;
  left.has_parking = street.parks_left && may_park;
  right.has_parking = street.parks_right && may_park;
  with_slip.has_slip = true;

  struct Part {
    double begin, end;
    Side left, right;
  };
  std::vector<Part> parts{{begin, end, left, right}};
  if (street.slip_at_start) parts.insert(parts.begin(), {0, begin, with_slip, plain});
  if (street.slip_at_end) parts.push_back({end, length, plain, with_slip});

  const int added = add_road(street.curve, 0, "", speed_mps(street.kind), left, right, style);
  opendrive::FileRoad& built = road(added);
  built.elevation = elevation_profile(layout_.end_height_m(index, true), layout_.end_height_m(index, false), length);
  built.sections.clear();
  for (const Part& part : parts)
    built.sections.push_back(make_section(part.begin, part.end, part.left, part.right, style));
  for (std::size_t i = 1; i < parts.size(); ++i) {
    link_sections(&built.sections[i - 1], parts[i - 1].left, parts[i - 1].right, &built.sections[i], parts[i].left,
                  parts[i].right);
  }
  for (const opendrive::FileSection& section : built.sections) {
    if (section.s != begin) continue;
    if (left.has_parking) add_parking_spaces(&built, section, street.lane_width_m, true);
    if (right.has_parking) add_parking_spaces(&built, section, street.lane_width_m, false);
  }
  sides_at({added, true}) = {parts.front().left, parts.front().right};
  sides_at({added, false}) = {parts.back().left, parts.back().right};
}

/// Builds a road from one arm to another without a junction: a bend, or one of the streets of an overpass.
void TownBuilder::build_bend(const Node& node, const Arm& from, const Arm& to, double height_m) {
  const StreetKind kind = street_of(from).kind;
  const Side side{.driving = street_of(from).lanes,
                  .has_median = kind == StreetKind::motorway,
                  .has_sidewalk = street_of(from).has_sidewalks && street_of(to).has_sidewalks};
  const bool is_corner = node.is_bend();
  const double speed = !is_corner                     ? speed_mps(kind)
                       : kind == StreetKind::motorway ? kMotorwayBendSpeed_mps
                                                      : kJunctionSpeed_mps;
  const int bend = add_road(fillet(reversed(mouth_of(node, from)), mouth_of(node, to), kNoRadiusLimit_m), height_m, "",
                            speed, side, side, SectionStyle(layout_.lane_width_m()));
  join({bend, true}, end_of(from));
  join({bend, false}, end_of(to));
}

void TownBuilder::set_lane_link(RoadEnd end, int lane, int other) {
  opendrive::FileRoad& owner = road(end.road);
  opendrive::FileSection& section = end.at_start ? owner.sections.front() : owner.sections.back();
  opendrive::FileLane& linked = lane > 0 ? section.left[lane - 1] : section.right[-lane - 1];
  (end.at_start ? linked.predecessors : linked.successors) = {other};
}

void TownBuilder::set_road_link(RoadEnd end, RoadEnd other) {
  opendrive::RoadLink& link = end.at_start ? road(end.road).predecessor : road(end.road).successor;
  link.kind = opendrive::RoadLink::Kind::road;
  link.id = road(other.road).id;
  link.contact = other.at_start ? opendrive::ContactPoint::start : opendrive::ContactPoint::end;
}

void TownBuilder::set_junction_link(RoadEnd end, const std::string& junction) {
  opendrive::RoadLink& link = end.at_start ? road(end.road).predecessor : road(end.road).successor;
  link.kind = opendrive::RoadLink::Kind::junction;
  link.id = junction;
}

void TownBuilder::join(RoadEnd a, RoadEnd b) {
  set_road_link(a, b);
  set_road_link(b, a);
  for (const bool arriving : {true, false}) {
    const Side& own = side(a, arriving);
    for (int rank = 1; rank <= own.count(); ++rank) {
      const LaneKind kind = own.kind_at(rank);
      const int lane = lane_id(a, arriving, kind, own.index_at(rank)),
                other = lane_id(b, !arriving, kind, own.index_at(rank));
      if (other == 0) continue;
      set_lane_link(a, lane, other);
      set_lane_link(b, other, lane);
    }
  }
}

void TownBuilder::connect(RoadEnd from, int connecting, RoadEnd to, const Movement& movement,
                          opendrive::FileJunction* junction) {
  set_road_link({connecting, true}, from);
  set_road_link({connecting, false}, to);
  opendrive::Connection connection;
  connection.incoming_road = road(from.road).id;
  connection.connecting_road = road(connecting).id;
  const Side own = sides_at({connecting, true}).right;
  for (int rank = 1; rank <= own.count(); ++rank) {
    const LaneKind kind = own.kind_at(rank);
    const int in = movement.is_slip && kind == LaneKind::driving
                       ? lane_id(from, true, LaneKind::slip)
                       : lane_id(from, true, kind, movement.first_in + own.index_at(rank));
    const int out = lane_id(to, false, kind, movement.first_out + own.index_at(rank));
    if (in != 0) {
      set_lane_link({connecting, true}, -rank, in);
      connection.lane_links.push_back({in, -rank, {}});
    }
    if (out != 0) set_lane_link({connecting, false}, -rank, out);
  }
  junction->connections.push_back(std::move(connection));
}

void TownBuilder::finish_junction(opendrive::FileJunction junction) {
  network_.junction_index.emplace(junction.id, static_cast<int>(network_.junctions.size()));
  network_.junctions.push_back(std::move(junction));
}

}  // namespace pictura::town
