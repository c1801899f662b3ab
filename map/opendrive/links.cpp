// Links lanes according to their own links, the links of their roads, and the connections of junctions.
#include <algorithm>
#include <set>

#include <fmt/format.h>

#include "pictura/map/opendrive/build.h"

namespace pictura::opendrive {

namespace {

// Maximum gap between linked lanes. Links of the file with larger gaps are omitted; for example, Town03 links two
// neighbouring lanes to one next lane.
constexpr float kMaxLinkGap_m = 1.0f;

/// One end of a lane. Start and end refer to the direction of s, not of traffic.
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
      for (const Connection& connection : junction.connections) link_connection(connection);
    }
    store();
  }

 private:
  const FileRoad& road_of(int index) const { return build_.network.roads[index]; }

  int road_named(const std::string& id) const { return build_.network.road_index.at(id); }

  /// Returns the end of lane `id` at one end of a road.
  LaneEnd end_of_road(int road, ContactPoint contact, int id) const {
    const int section = contact == ContactPoint::start ? 0 : static_cast<int>(road_of(road).sections.size()) - 1;
    return {road, section, id, contact};
  }

  const FileLane* file_lane(const LaneEnd& end) const { return road_of(end.road).sections[end.section].lane(end.id); }

  /// Whether the lane of an end exists. If not, the fault is repaired by omitting the link to the lane.
  bool exists(const LaneEnd& end, const SourceLocation& where) const {
    if (file_lane(end)) return true;
    where.record_repair(build_.faults, RepairKind::missing_lane,
                        "is linked to lane {} of road {}, which does not exist there", end.id, road_of(end.road).id);
    return false;
  }

  void link_road(int road) {
    const FileRoad& file_road = road_of(road);
    for (int section = 0; section < static_cast<int>(file_road.sections.size()); ++section) {
      const FileSection& file_section = file_road.sections[section];
      for (const std::vector<FileLane>* side : {&file_section.left, &file_section.right}) {
        for (const FileLane& lane : *side) {
          for (const int id : lane.successors) link_lane(road, section, lane, ContactPoint::end, id);
          for (const int id : lane.predecessors) link_lane(road, section, lane, ContactPoint::start, id);
        }
      }
    }
  }

  /// Links a lane at one end of its section: to the next section, or across the road's link.
  void link_lane(int road, int section, const FileLane& lane, ContactPoint end, int target_id) {
    const FileRoad& file_road = road_of(road);
    const bool at_end = end == ContactPoint::end;
    const int next = at_end ? section + 1 : section - 1;
    LaneEnd target{road, next, target_id, at_end ? ContactPoint::start : ContactPoint::end};
    if (next < 0 || next >= static_cast<int>(file_road.sections.size())) {
      const RoadLink& link = at_end ? file_road.successor : file_road.predecessor;
      if (link.kind == RoadLink::Kind::none && !link.where.source && is_drivable(lane.type)) {
        lane.where.record_repair(build_.faults, RepairKind::dangling_link,
                                 "is linked to lane {} beyond the {} of its road, which is linked to nothing there",
                                 target_id, at_end ? "end" : "start");
      }
      if (link.kind != RoadLink::Kind::road) return;  // connections link the lanes of a junction
      target = end_of_road(road_named(link.id), link.contact, target_id);
    }
    if (exists(target, lane.where)) add({road, section, lane.id, end}, target, lane.where);
  }

  void link_connection(const Connection& connection) {
    const int incoming = road_named(connection.incoming_road), connecting = road_named(connection.connecting_road);
    for (const LaneLink& link : connection.lane_links) {
      const LaneEnd from = end_of_road(incoming, connection.incoming_end, link.from);
      const LaneEnd to = end_of_road(connecting, connection.contact, link.to);
      if (exists(from, link.where) && exists(to, link.where)) add(from, to, link.where);
    }
  }

  /// Links two lanes that meet, in the order in which traffic passes them. Links that traffic cannot follow are omitted
  /// and recorded as repairs, except links between lanes that are not drivable, such as sidewalks.
  void add(const LaneEnd& a, const LaneEnd& b, const SourceLocation& where) {
    const int32_t lane_a = lane_at(a), lane_b = lane_at(b);
    if (lane_a < 0 || lane_b < 0) return;
    const LaneType type_a = build_.map->lanes[lane_a].type;
    const LaneType type_b = build_.map->lanes[lane_b].type;
    const auto leave_out = [&](RepairKind kind, const std::string& reason) {
      if (!is_drivable(type_a) && !is_drivable(type_b)) return;
      if (!left_out_.emplace(std::minmax(lane_a, lane_b)).second) return;
      where.record_repair(build_.faults, kind, "links lane {} of road {} with lane {} of road {}, {}", a.id,
                          road_of(a.road).id, b.id, road_of(b.road).id, reason);
    };
    if (type_a != type_b && !(is_drivable(type_a) && is_drivable(type_b))) {
      return leave_out(RepairKind::unlike_link,
                       fmt::format("which are {} and {}", to_string(type_a), to_string(type_b)));
    }
    if (is_exit(a) == is_exit(b)) return leave_out(RepairKind::opposed_link, "whose traffic meets head on there");
    const auto [from, to] = is_exit(a) ? std::pair(lane_a, lane_b) : std::pair(lane_b, lane_a);
    const float gap_m = length(end_of(from) - begin_of(to));
    if (!(gap_m <= kMaxLinkGap_m)) {
      return leave_out(RepairKind::distant_link, fmt::format("which are {:.2f} m apart there", gap_m));
    }
    links_.emplace(from, to);
  }

  Vec3 begin_of(int32_t lane) const {
    const RoadMap& map = *build_.map;
    return map.points_of(map.lanes[lane])[0].position_m;
  }

  Vec3 end_of(int32_t lane) const {
    const RoadMap& map = *build_.map;
    return map.lane_points[static_cast<std::size_t>(map.lanes[lane].points.end) - 1].position_m;
  }

  int32_t lane_at(const LaneEnd& end) const { return build_.lanes[end.road][end.section].of(end.id); }

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
  std::set<std::pair<int32_t, int32_t>> links_, left_out_;
};

}  // namespace

void link_lanes(Build* build) { Linker(build).link_all(); }

}  // namespace pictura::opendrive
