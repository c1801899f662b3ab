// Lane links: from lanes' own links, across the links of their roads, and from junctions' connections.
#include <algorithm>
#include <set>

#include "pictura/map/opendrive/build.h"

namespace pictura::opendrive {

namespace {

// Lanes whose ends are further apart are not linked, whatever the file says (Town03 links two neighbouring lanes to the
// same next one).
constexpr float kMaxLinkGap_m = 1.0f;

/// One end of a lane, in terms of s of its road.
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
      for (const Connection& connection : junction.connections) {
        build_.faults->attempt([&] { link_connection(junction, connection); });
      }
    }
    store();
  }

 private:
  const FileRoad& road_of(int index) const { return build_.network.roads[static_cast<std::size_t>(index)]; }

  int road_named(const std::string& id, const SourceLocation& where) const {
    const auto found = build_.network.road_index.find(id);
    if (found == build_.network.road_index.end()) where.fail("refers to road {}, which does not exist", id);
    return found->second;
  }

  /// The end of lane `id` at one end of a road.
  LaneEnd end_of_road(int road, ContactPoint contact, int id) const {
    const int section = contact == ContactPoint::start ? 0 : static_cast<int>(road_of(road).sections.size()) - 1;
    return {road, section, id, contact};
  }

  const FileLane* file_lane(const LaneEnd& end) const {
    return road_of(end.road).sections[static_cast<std::size_t>(end.section)].lane(end.id);
  }

  bool exists(const LaneEnd& end) const { return file_lane(end) != nullptr; }

  [[noreturn]] void fail_missing(const LaneEnd& end, const SourceLocation& where) const {
    where.fail("is linked to lane {} of road {}, which does not exist there", end.id, road_of(end.road).id);
  }

  void link_road(int road) {
    const FileRoad& file_road = road_of(road);
    const int num_sections = static_cast<int>(file_road.sections.size());
    const bool start_is_sound = build_.faults->attempt([&] { check_road_link(file_road, ContactPoint::start); });
    const bool end_is_sound = build_.faults->attempt([&] { check_road_link(file_road, ContactPoint::end); });
    for (int section = 0; section < num_sections; ++section) {
      const FileSection& file_section = file_road.sections[static_cast<std::size_t>(section)];
      for (const std::vector<FileLane>* side : {&file_section.left, &file_section.right}) {
        for (const FileLane& lane : *side) {
          for (const int id : lane.successors) {
            if (section + 1 == num_sections && !end_is_sound) break;
            build_.faults->attempt([&] { link_lane(road, section, lane, ContactPoint::end, id); });
          }
          for (const int id : lane.predecessors) {
            if (section == 0 && !start_is_sound) break;
            build_.faults->attempt([&] { link_lane(road, section, lane, ContactPoint::start, id); });
          }
        }
      }
    }
  }

  static const RoadLink& link_at(const FileRoad& road, ContactPoint end) {
    return end == ContactPoint::start ? road.predecessor : road.successor;
  }

  /// Checks that a road link's target exists and that, if the target is linked to a road there, it is linked back to
  /// this road end.
  void check_road_link(const FileRoad& road, ContactPoint end) const {
    const RoadLink& link = link_at(road, end);
    if (link.kind == RoadLink::Kind::junction && !build_.network.junction_index.contains(link.id)) {
      link.where.fail("refers to junction {}, which does not exist", link.id);
    }
    if (link.kind != RoadLink::Kind::road) return;
    const RoadLink& back = link_at(road_of(road_named(link.id, link.where)), link.contact);
    if (link.id == road.id && (link.contact == end || back.kind != RoadLink::Kind::road)) {
      link.where.fail("its {} is linked to the road's own {}, which is not linked back", name_of(end),
                      name_of(link.contact));
    }
    if (back.kind == RoadLink::Kind::road && (back.id != road.id || back.contact != end)) {
      link.where.fail("the {} of road {} is linked to the {} of road {} instead of the {} of this one",
                      name_of(link.contact), link.id, name_of(back.contact), back.id, name_of(end));
    }
  }

  static const char* name_of(ContactPoint end) { return end == ContactPoint::start ? "start" : "end"; }

  /// Links a lane at one end of its section: to the next section, or across the road's link.
  void link_lane(int road, int section, const FileLane& lane, ContactPoint end, int target_id) {
    const FileRoad& file_road = road_of(road);
    const bool at_end = end == ContactPoint::end;
    const int next = at_end ? section + 1 : section - 1;
    LaneEnd target{road, next, target_id, at_end ? ContactPoint::start : ContactPoint::end};
    if (next < 0 || next >= static_cast<int>(file_road.sections.size())) {
      const RoadLink& link = link_at(file_road, end);
      if (link.kind != RoadLink::Kind::road) return;
      target = end_of_road(road_named(link.id, link.where), link.contact, target_id);
    }
    if (exists(target)) {
      add({road, section, lane.id, end}, target);
    } else if (is_drivable(lane.type)) {
      // Only an error on drivable lanes: Town07 has a shoulder whose link target is missing.
      fail_missing(target, lane.where);
    }
  }

  void link_connection(const FileJunction& junction, const Connection& connection) {
    const int incoming = road_named(connection.incoming_road, connection.where);
    const int connecting = road_named(connection.connecting_road, connection.where);
    const FileRoad& connecting_road = road_of(connecting);
    const RoadLink& back = link_at(connecting_road, connection.contact);
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
      build_.faults->attempt([&] {
        const LaneEnd from = end_of_road(incoming, incoming_end, link.from);
        const LaneEnd to = end_of_road(connecting, connection.contact, link.to);
        for (const LaneEnd& end : {from, to}) {
          if (!exists(end)) fail_missing(end, link.where);
        }
        add(from, to);
      });
    }
  }

  /// Links two lanes that meet, in the order in which traffic passes them.
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

  bool is_exit(const LaneEnd& end) const {
    return travels_forward(road_of(end.road), *file_lane(end)) == (end.end == ContactPoint::end);
  }

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

void link_lanes(Build* build) { Linker(build).link_all(); }

}  // namespace pictura::opendrive
