// Lanes from sections: centre lines in the direction of travel, neighbours, links, speed limits, endless routes.
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "pictura/map/opendrive/build.h"
#include "pictura/map/speed_limit.h"

namespace pictura::opendrive {

namespace {

// Lanes whose ends lie further apart than this do not continue each other, whatever the file says (Town03 links two
// neighbouring lanes to the same next one).
constexpr float kMaxLinkGap_m = 1.0f;
// Float coordinates keep a resolution of 8 mm within this range of the origin.
constexpr double kMaxMapRadius_m = 1e5;

/// Types that one may drive through from lane to lane; routes are made of them.
bool is_route(LaneType type) { return type == LaneType::driving || type == LaneType::ramp; }

/// Heading of a lane's centre line towards growing s: the slope of t turns it away from the reference line, more so
/// where it runs inside a curve. Slopes come from the formulae, since files have steps between them.
double center_heading(const FileRoad& road, const FileSection& section, int inner, int outer, double s) {
  const double t = 0.5 * (border_t(road, section, inner, s) + border_t(road, section, outer, s));
  const double slope = 0.5 * (border_slope(road, section, inner, s) + border_slope(road, section, outer, s));
  const Pose pose = pose_at(road, s);
  return pose.heading + std::atan2(slope, 1.0 - pose.curvature * t);
}

Lane make_lane(Build* build, const FileRoad& road, const FileSection& section, const FileLane& lane) {
  const bool forward = travels_forward(lane.id);
  const int inner = lane.id > 0 ? lane.id - 1 : lane.id + 1;
  auto center_t = [&](double s) {
    return 0.5 * (border_t(road, section, inner, s) + border_t(road, section, lane.id, s));
  };
  std::vector<CurvePoint> points =
      sample_curve(formula_changes(road, section, lane.id, section.s, section.end), build->options.chord_error_m,
                   kMaxPiece_m, &build->budget, [&](double s) {
                     const Point3 p = point_at(road, s, center_t(s));
                     return CurvePoint{s, p.x, p.y, p.z, lane_width(section, lane, s)};
                   });
  if (!forward) std::reverse(points.begin(), points.end());

  Lane result;
  result.type = lane.type;
  result.points.begin = static_cast<int32_t>(build->map->lane_points.size());
  double length_m = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const CurvePoint& point = points[i];
    if (i > 0) length_m += std::hypot(point.x - points[i - 1].x, point.y - points[i - 1].y);
    const double heading =
        std::remainder(center_heading(road, section, inner, lane.id, point.s) + (forward ? 0.0 : std::numbers::pi),
                       2 * std::numbers::pi);
    build->map->lane_points.push_back({build->to_map(point.x, point.y, point.z), static_cast<float>(heading),
                                       static_cast<float>(point.width), static_cast<float>(length_m)});
  }
  result.points.end = static_cast<int32_t>(build->map->lane_points.size());
  result.length_m = static_cast<float>(length_m);
  return result;
}

/// One end of a lane, in terms of its road's s.
struct LaneEnd {
  int road = 0, section = 0, id = 0;
  ContactPoint end = ContactPoint::start;
};

class Linker {
 public:
  explicit Linker(Build* build) : build_(*build) {}

  void link_all() {
    for (std::size_t road = 0; road < build_.network.roads.size(); ++road) link_road(static_cast<int>(road));
    for (const FileJunction& junction : build_.network.junctions) {
      for (const Connection& connection : junction.connections) link_connection(junction, connection);
    }
    store();
  }

 private:
  const FileRoad& road_of(int index) const { return build_.network.roads[static_cast<std::size_t>(index)]; }

  int road_named(const std::string& id, const Where& where) const {
    const auto found = build_.network.road_index.find(id);
    if (found == build_.network.road_index.end()) where.fail("refers to road {}, which does not exist", id);
    return found->second;
  }

  /// The lane `id` at one end of a road.
  LaneEnd end_of_road(int road, ContactPoint contact, int id) const {
    const int section = contact == ContactPoint::start ? 0 : static_cast<int>(road_of(road).sections.size()) - 1;
    return {road, section, id, contact};
  }

  bool exists(const LaneEnd& end) const {
    return road_of(end.road).sections[static_cast<std::size_t>(end.section)].lane(end.id) != nullptr;
  }

  [[noreturn]] void fail_missing(const LaneEnd& end, const Where& where) const {
    where.fail("is linked to lane {} of road {}, which does not exist there", end.id, road_of(end.road).id);
  }

  void link_road(int road) {
    const FileRoad& file_road = road_of(road);
    const int num_sections = static_cast<int>(file_road.sections.size());
    for (const RoadLink* link : {&file_road.predecessor, &file_road.successor}) {
      if (link->kind == RoadLink::Kind::road) road_named(link->id, link->where);
      if (link->kind == RoadLink::Kind::junction && !build_.network.junction_index.contains(link->id)) {
        link->where.fail("refers to junction {}, which does not exist", link->id);
      }
    }
    for (int section = 0; section < num_sections; ++section) {
      const FileSection& file_section = file_road.sections[static_cast<std::size_t>(section)];
      for (const std::vector<FileLane>* side : {&file_section.left, &file_section.right}) {
        for (const FileLane& lane : *side) {
          if (lane.successor) link_lane(road, section, lane, ContactPoint::end, *lane.successor);
          if (lane.predecessor) link_lane(road, section, lane, ContactPoint::start, *lane.predecessor);
        }
      }
    }
  }

  /// Follows the lane's own link at one end of its section: to the next section, or over the road's link.
  void link_lane(int road, int section, const FileLane& lane, ContactPoint end, int target_id) {
    const FileRoad& file_road = road_of(road);
    const bool at_end = end == ContactPoint::end;
    const int next = at_end ? section + 1 : section - 1;
    LaneEnd target{road, next, target_id, at_end ? ContactPoint::start : ContactPoint::end};
    if (next < 0 || next >= static_cast<int>(file_road.sections.size())) {
      const RoadLink& link = at_end ? file_road.successor : file_road.predecessor;
      if (link.kind != RoadLink::Kind::road) return;
      target = end_of_road(road_named(link.id, link.where), link.contact, target_id);
    }
    if (exists(target)) {
      add({road, section, lane.id, end}, target);
    } else if (is_drivable(lane.type)) {
      // Town07 has a shoulder whose link leads nowhere; only where one drives is that a fault.
      fail_missing(target, lane.where);
    }
  }

  void link_connection(const FileJunction& junction, const Connection& connection) {
    const int incoming = road_named(connection.incoming_road, connection.where);
    const int connecting = road_named(connection.connecting_road, connection.where);
    const FileRoad& connecting_road = road_of(connecting);
    const RoadLink& back =
        connection.contact == ContactPoint::start ? connecting_road.predecessor : connecting_road.successor;
    ContactPoint incoming_end = ContactPoint::start;
    if (back.kind == RoadLink::Kind::road && back.id == connection.incoming_road) {
      incoming_end = back.contact;
    } else {
      const FileRoad& incoming_road = road_of(incoming);
      auto meets = [&](const RoadLink& link) {
        return link.kind == RoadLink::Kind::junction && link.id == junction.id;
      };
      if (meets(incoming_road.successor)) {
        incoming_end = ContactPoint::end;
      } else if (!meets(incoming_road.predecessor)) {
        connection.where.fail("its incoming road {} has no end at this junction", connection.incoming_road);
      }
    }
    for (const LaneLink& link : connection.lane_links) {
      const LaneEnd from = end_of_road(incoming, incoming_end, link.from);
      const LaneEnd to = end_of_road(connecting, connection.contact, link.to);
      for (const LaneEnd& end : {from, to}) {
        if (!exists(end)) fail_missing(end, connection.where);
      }
      add(from, to);
    }
  }

  /// Links two lanes that touch, in whichever order traffic passes them.
  void add(const LaneEnd& a, const LaneEnd& b) {
    const int32_t lane_a = lane_at(a), lane_b = lane_at(b);
    if (lane_a < 0 || lane_b < 0) return;
    const LaneType type_a = build_.map->lanes[static_cast<std::size_t>(lane_a)].type;
    const LaneType type_b = build_.map->lanes[static_cast<std::size_t>(lane_b)].type;
    if (type_a != type_b && !(is_drivable(type_a) && is_drivable(type_b))) return;
    if (is_exit(a) && !is_exit(b)) add_in_order(lane_a, lane_b);
    if (is_exit(b) && !is_exit(a)) add_in_order(lane_b, lane_a);
  }

  void add_in_order(int32_t from, int32_t to) {
    const RoadMap& map = *build_.map;
    const Vec3 end =
        map.lane_points[static_cast<std::size_t>(map.lanes[static_cast<std::size_t>(from)].points.end) - 1].position_m;
    const Vec3 begin =
        map.lane_points[static_cast<std::size_t>(map.lanes[static_cast<std::size_t>(to)].points.begin)].position_m;
    if (length(end - begin) <= kMaxLinkGap_m) links_.emplace(from, to);
  }

  int32_t lane_at(const LaneEnd& end) const {
    return build_.lanes[static_cast<std::size_t>(end.road)][static_cast<std::size_t>(end.section)].of(end.id);
  }

  static bool is_exit(const LaneEnd& end) { return travels_forward(end.id) == (end.end == ContactPoint::end); }

  void store() {
    std::vector<Lane>& lanes = build_.map->lanes;
    std::vector<int32_t>& stored = build_.map->lane_links;
    std::set<std::pair<int32_t, int32_t>> backward;
    for (const auto& [from, to] : links_) backward.emplace(to, from);
    auto fill = [&](const std::set<std::pair<int32_t, int32_t>>& links, IndexRange Lane::* range) {
      auto link = links.begin();
      for (std::size_t lane = 0; lane < lanes.size(); ++lane) {
        (lanes[lane].*range).begin = static_cast<int32_t>(stored.size());
        for (; link != links.end() && link->first == static_cast<int32_t>(lane); ++link) stored.push_back(link->second);
        (lanes[lane].*range).end = static_cast<int32_t>(stored.size());
      }
    };
    fill(links_, &Lane::successors);
    fill(backward, &Lane::predecessors);
  }

  Build& build_;
  std::set<std::pair<int32_t, int32_t>> links_;
};

}  // namespace

void choose_origin(Build* build) {
  double low[2] = {1e300, 1e300}, high[2] = {-1e300, -1e300};
  for (const FileRoad& road : build->network.roads) {
    for (const GeometryPiece& piece : road.geometry) {
      const double xy[2] = {piece.x, piece.y};
      for (int axis = 0; axis < 2; ++axis) {
        low[axis] = std::min(low[axis], xy[axis]);
        high[axis] = std::max(high[axis], xy[axis]);
      }
    }
  }
  for (int axis = 0; axis < 2; ++axis)
    build->map->origin_m[static_cast<std::size_t>(axis)] = std::round(0.5 * (low[axis] + high[axis]));
  for (const FileRoad& road : build->network.roads) {
    for (const GeometryPiece& piece : road.geometry) {
      const double radius_m = std::hypot(piece.x - build->map->origin_m[0], piece.y - build->map->origin_m[1]);
      if (radius_m > kMaxMapRadius_m) {
        road.where.fail("lies {:.0f} m from the middle of the map; expected at most {} m", radius_m, kMaxMapRadius_m);
      }
    }
  }
}

void build_lanes(Build* build) {
  RoadMap& map = *build->map;
  for (std::size_t r = 0; r < build->network.roads.size(); ++r) {
    const FileRoad& road = build->network.roads[r];
    map.road_names.push_back(road.id);
    int32_t junction = -1;
    if (!road.junction.empty()) {
      const auto found = build->network.junction_index.find(road.junction);
      if (found == build->network.junction_index.end()) {
        road.where.fail("belongs to junction {}, which does not exist", road.junction);
      }
      junction = found->second;
    }
    std::vector<SectionLanes>& sections = build->lanes.emplace_back();
    for (std::size_t k = 0; k < road.sections.size(); ++k) {
      const FileSection& section = road.sections[k];
      SectionLanes& indices = sections.emplace_back();
      auto add_side = [&](const std::vector<FileLane>& side, std::vector<int32_t>* indices_out) {
        for (const FileLane& lane : side) {
          indices_out->push_back(lane.is_void ? -1 : static_cast<int32_t>(map.lanes.size()));
          if (lane.is_void) continue;
          Lane made = make_lane(build, road, section, lane);
          made.in_junction = junction >= 0;
          made.junction = junction;
          made.source_road = static_cast<int32_t>(r);
          made.source_section = static_cast<int32_t>(k);
          made.source_lane = lane.id;
          map.lanes.push_back(made);
        }
        // On either side the lane further from the center is the one to the right.
        for (std::size_t i = 1; i < side.size(); ++i) {
          const int32_t inner = (*indices_out)[i - 1], outer = (*indices_out)[i];
          if (inner < 0 || outer < 0) continue;
          Lane &inner_lane = map.lanes[static_cast<std::size_t>(inner)],
               &outer_lane = map.lanes[static_cast<std::size_t>(outer)];
          if (!is_route(inner_lane.type) || !is_route(outer_lane.type)) continue;
          inner_lane.right_neighbor = outer;
          outer_lane.left_neighbor = inner;
        }
      };
      add_side(section.left, &indices.left);
      add_side(section.right, &indices.right);
    }
  }
}

void link_lanes(Build* build) { Linker(build).link_all(); }

void set_speed_limits(Build* build) {
  RoadMap& map = *build->map;
  for (Lane& lane : map.lanes) {
    const FileRoad& road = build->network.roads[static_cast<std::size_t>(lane.source_road)];
    const FileSection& section = road.sections[static_cast<std::size_t>(lane.source_section)];
    lane.speed_limit_mps = static_cast<float>(road.speed_limit_at(0.5 * (section.s + section.end)));
  }
  // Lanes without a limit, as those of junctions, take the highest of the lanes that lead into them, then of those that
  // they lead to, over as many lanes as it takes.
  auto inherit = [&](IndexRange Lane::* onward) {
    std::vector<int32_t> known;
    for (std::size_t i = 0; i < map.lanes.size(); ++i) {
      if (map.lanes[i].speed_limit_mps > 0) known.push_back(static_cast<int32_t>(i));
    }
    while (!known.empty()) {
      std::map<int32_t, float> inherited;
      for (const int32_t from : known) {
        const Lane& lane = map.lanes[static_cast<std::size_t>(from)];
        for (const int32_t to : map.links(lane.*onward)) {
          if (map.lanes[static_cast<std::size_t>(to)].speed_limit_mps > 0) continue;
          float& limit = inherited[to];
          limit = max_of(limit, lane.speed_limit_mps);
        }
      }
      known.clear();
      for (const auto& [lane, limit] : inherited) {
        map.lanes[static_cast<std::size_t>(lane)].speed_limit_mps = limit;
        known.push_back(lane);
      }
    }
  };
  inherit(&Lane::successors);
  inherit(&Lane::predecessors);
  for (Lane& lane : map.lanes) {
    if (lane.speed_limit_mps <= 0) lane.speed_limit_mps = kDefaultSpeedLimit_mps;
  }
}

void find_endless_lanes(Build* build) {
  RoadMap& map = *build->map;
  // Lanes between which one may change share a group, named by its leftmost lane. A group dies when none of its lanes
  // leads to a living group, and takes with it what only led there.
  std::vector<std::size_t> group(map.lanes.size());
  std::vector<std::vector<std::size_t>> members(map.lanes.size());
  for (std::size_t i = 0; i < map.lanes.size(); ++i) {
    std::size_t leftmost = i;
    while (map.lanes[leftmost].left_neighbor >= 0)
      leftmost = static_cast<std::size_t>(map.lanes[leftmost].left_neighbor);
    group[i] = leftmost;
    members[leftmost].push_back(i);
  }
  auto is_route_lane = [&](int32_t lane) { return is_route(map.lanes[static_cast<std::size_t>(lane)].type); };
  std::vector<int> ways_on(map.lanes.size(), 0);
  for (std::size_t i = 0; i < map.lanes.size(); ++i) {
    if (!is_route(map.lanes[i].type)) continue;
    for (const int32_t next : map.links(map.lanes[i].successors)) ways_on[group[i]] += is_route_lane(next) ? 1 : 0;
  }
  std::vector<std::size_t> dead;
  for (std::size_t i = 0; i < map.lanes.size(); ++i) {
    if (group[i] == i && ways_on[i] == 0) dead.push_back(i);
  }
  while (!dead.empty()) {
    const std::size_t died = dead.back();
    dead.pop_back();
    for (const std::size_t lane : members[died]) {
      if (!is_route(map.lanes[lane].type)) continue;
      for (const int32_t before : map.links(map.lanes[lane].predecessors)) {
        if (!is_route_lane(before)) continue;
        const std::size_t other = group[static_cast<std::size_t>(before)];
        if (--ways_on[other] == 0) dead.push_back(other);
      }
    }
  }
  for (std::size_t i = 0; i < map.lanes.size(); ++i) {
    map.lanes[i].is_endless = is_route(map.lanes[i].type) && ways_on[group[i]] > 0;
  }
}

}  // namespace pictura::opendrive
