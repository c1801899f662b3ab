// Builds traffic lights and signs from the regulatory elements of a Lanelet2 map, and counts the map's facts.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <set>
#include <string>

#include "pictura/common/scene.h"
#include "pictura/map/lanelet2/build.h"
#include "pictura/map/light_phases.h"
#include "pictura/map/polyline_lanes.h"

namespace pictura::lanelet2 {

namespace {

// Default heights of near and far heads above the stop line, as for OpenDRIVE. They apply if the file's head is less
// than kLowestHead_m above the line.
constexpr float kNearHeadHeight_m = 3.5f, kFarHeadHeight_m = 5.5f, kLowestHead_m = 1.5f;
constexpr float kFarHead_m = 5.0f;
constexpr float kMinStopLine_m = 0.1f;
constexpr float kJunctionAhead_m = 40.0f;  // maximum distance along lanes from a light to its junction

/// Returns the position on a lane that is nearest to a point, as a fraction of the lane's length.
float nearest_share(const RoadMap& map, int32_t lane, Vec3 p) {
  const Span<const LanePoint> points = map.points_of(map.lanes[lane]);
  float best_m = std::numeric_limits<float>::infinity(), s_m = 0;
  for (std::size_t i = 1; i < points.size(); ++i) {
    const Vec2 a = points[i - 1].position_m.xy(), way = points[i].position_m.xy() - a;
    const float t = clamp(dot(p.xy() - a, way) / max_of(dot(way, way), 1e-12f), 0.0f, 1.0f);
    const float away_m = length(p.xy() - (a + way * t));
    if (away_m >= best_m) continue;
    best_m = away_m;
    s_m = points[i - 1].s_m + t * (points[i].s_m - points[i - 1].s_m);
  }
  return s_m / map.lanes[lane].length_m;
}

void sort_unique(std::vector<int32_t>* values) {
  std::sort(values->begin(), values->end());
  values->erase(std::unique(values->begin(), values->end()), values->end());
}

class RuleBuilder {
 public:
  explicit RuleBuilder(Build* build)
      : build_(*build),
        map_(*build->map),
        file_(build->file),
        lanes_of_rule_(file_.relations.size()),
        is_referred_to_(file_.relations.size(), false) {}

  void run() {
    for (const Lanelet& lanelet : build_.lanelets) {
      for (const int32_t rule : build_.relation_of(lanelet).relations("regulatory_element")) {
        is_referred_to_[rule] = true;
        if (lanelet.lane >= 0) lanes_of_rule_[rule].push_back(lanelet.lane);
      }
    }
    for (std::vector<int32_t>& lanes : lanes_of_rule_) sort_unique(&lanes);
    for (std::size_t i = 0; i < file_.relations.size(); ++i) {
      if (file_.relations[i].tags.of("subtype") == "traffic_light") collect_light(static_cast<int32_t>(i));
    }
    for (auto& [key, approach] : approaches_) add_light(&approach);
    for (std::size_t junction = 0; junction < map_.junctions.size(); ++junction) {
      map_.junctions[junction].num_phases = static_cast<int32_t>(axes_[static_cast<int32_t>(junction)].size());
    }
    add_signs();
  }

 private:
  /// Heads, lanes and stop line of one or several regulatory elements.
  struct Approach {
    int32_t relation = -1;        // the first of the elements
    int32_t stop_line = -1;       // way, or -1
    std::vector<int32_t> heads;   // ways
    std::vector<int32_t> tagged;  // lanes that refer to any of the elements
    std::vector<int32_t> incoming, connecting;
  };

  /// Adds a regulatory element to its light. Elements with the same stop line are one light, because Autoware's maps
  /// have an element for each lane behind the line. Elements without a stop line are one light if they have the same
  /// heads.
  void collect_light(int32_t index) {
    const Relation& relation = file_.relations[index];
    const auto usable = [&](std::string_view role) {
      std::vector<int32_t> ways = relation.ways(role);
      std::erase_if(ways, [&](int32_t way) { return file_.ways[way].nodes.empty(); });
      return ways;
    };
    const std::vector<int32_t> heads = usable("refers");
    std::vector<int32_t> lines = usable("ref_line");
    std::erase_if(lines, [&](int32_t way) {
      const Points points = build_.points_of(way);
      return plan_distance_m(points.front(), points.back()) < double{kMinStopLine_m};
    });
    if (heads.empty()) {
      return file_.where(relation).record_repair(build_.faults, RepairKind::empty_rule,
                                                 "expected a way with the role refers");
    }
    if (lanes_of_rule_[index].empty()) {
      if (is_referred_to_[index]) return;  // a light for pedestrians
      return file_.where(relation).record_repair(build_.faults, RepairKind::laneless_light,
                                                 "expected a lanelet that refers to it as regulatory_element");
    }
    std::vector<int32_t> key = lines.empty() ? heads : std::vector<int32_t>{lines.front()};
    std::sort(key.begin(), key.end());
    key.insert(key.begin(), lines.empty() ? 0 : 1);
    const auto [found, is_new] = approaches_.try_emplace(std::move(key));
    Approach& approach = found->second;
    if (is_new) {
      approach.relation = index;
      approach.stop_line = lines.empty() ? -1 : lines.front();
    }
    const std::vector<int32_t>& lanes = lanes_of_rule_[index];
    approach.heads.insert(approach.heads.end(), heads.begin(), heads.end());
    approach.tagged.insert(approach.tagged.end(), lanes.begin(), lanes.end());
  }

  Vec3 center_of(int32_t way) const {
    const Points points = build_.points_of(way);
    Eigen::Vector3d sum{0, 0, 0};
    for (const Eigen::Vector3d& p : points) sum += p;
    return to_vec3((sum / static_cast<double>(points.size())).eval());
  }

  /// Finds incoming and connecting lanes. A tagged lane either leads to the stop line or begins at it.
  void find_lanes(Approach* approach) {
    sort_unique(&approach->heads);
    sort_unique(&approach->tagged);
    std::optional<Vec3> stop;
    if (approach->stop_line >= 0) {
      const Points line = build_.points_of(approach->stop_line);
      stop = to_vec3((0.5 * (line.front() + line.back())).eval());
    }
    const auto add_driving = [&](IndexRange range, std::vector<int32_t>* lanes) {
      for (const int32_t lane : map_.links(range)) {
        if (map_.lanes[lane].type == LaneType::driving) lanes->push_back(lane);
      }
    };
    for (const int32_t index : approach->tagged) {
      const Lane& lane = map_.lanes[index];
      build_.count_work(static_cast<std::size_t>(lane.points.size()));
      const bool begins_there = stop ? nearest_share(map_, index, *stop) < 0.5f : lane.in_junction;
      (begins_there ? approach->connecting : approach->incoming).push_back(index);
      if (begins_there) add_driving(lane.predecessors, &approach->incoming);
    }
    // One regulatory element may make a lane incoming, and another may make it connecting. Such a lane is only
    // connecting, because it does not lead to the stop line.
    sort_unique(&approach->incoming);
    sort_unique(&approach->connecting);
    std::erase_if(approach->incoming, [&](int32_t lane) {
      return std::binary_search(approach->connecting.begin(), approach->connecting.end(), lane);
    });
    for (const int32_t lane : approach->incoming) add_driving(map_.lanes[lane].successors, &approach->connecting);
    sort_unique(&approach->connecting);
  }

  /// Sets the light's stop line (its left end first) and its heading.
  void set_stop_line(const Approach& approach, TrafficLight* light) const {
    const bool is_incoming = !approach.incoming.empty();
    const int32_t lane = is_incoming ? approach.incoming.front() : approach.connecting.front();
    const LanePoint& at = is_incoming ? end_of(map_, lane) : start_of(map_, lane);
    light->stop_heading_rad = at.heading_rad;
    const Vec2 forward{std::cos(at.heading_rad), std::sin(at.heading_rad)}, left{-forward.y, forward.x};
    if (approach.stop_line >= 0) {
      const Points line = build_.points_of(approach.stop_line);
      light->stop_a_m = to_vec3(line.front());
      light->stop_b_m = to_vec3(line.back());
      if (dot((light->stop_a_m - light->stop_b_m).xy(), left) < 0) std::swap(light->stop_a_m, light->stop_b_m);
      return;
    }
    // If the file has no stop line, the line spans the ends of the lanes.
    float left_m = -1e30f, right_m = 1e30f;
    for (const int32_t each : is_incoming ? approach.incoming : approach.connecting) {
      const LanePoint& end = is_incoming ? end_of(map_, each) : start_of(map_, each);
      const Vec2 half = Vec2{-std::sin(end.heading_rad), std::cos(end.heading_rad)} * (0.5f * end.width_m);
      for (const float side : {1.0f, -1.0f}) {
        const Vec2 corner = end.position_m.xy() + half * side;
        const float lateral_m = dot(corner - at.position_m.xy(), left);
        const Vec3 position{corner.x, corner.y, end.position_m.z};
        if (lateral_m > left_m) light->stop_a_m = position;
        if (lateral_m < right_m) light->stop_b_m = position;
        left_m = max_of(left_m, lateral_m);
        right_m = min_of(right_m, lateral_m);
      }
    }
  }

  void add_light(Approach* approach) {
    const Relation& relation = file_.relations[approach->relation];
    find_lanes(approach);
    TrafficLight light{.name = std::to_string(relation.id)};
    set_stop_line(*approach, &light);
    if (length((light.stop_b_m - light.stop_a_m).xy()) < kMinStopLine_m) {
      return file_.where(relation).record_repair(build_.faults, RepairKind::laneless_light,
                                                 "controls lanes less than {} m wide", kMinStopLine_m);
    }
    const Vec2 forward{std::cos(light.stop_heading_rad), std::sin(light.stop_heading_rad)};
    light.head_facing = forward * -1.0f;
    set_head(*approach, forward, &light);
    light.junction = junction_ahead(*approach);
    if (light.junction >= 0) light.phase = phase_of_heading(double{light.stop_heading_rad}, &axes_[light.junction]);
    light.lanes.begin = static_cast<int32_t>(map_.light_lanes.size());
    for (const std::vector<int32_t>* lanes : {&approach->incoming, &approach->connecting}) {
      map_.light_lanes.insert(map_.light_lanes.end(), lanes->begin(), lanes->end());
    }
    light.lanes.end = static_cast<int32_t>(map_.light_lanes.size());
    map_.lights.push_back(light);
    map_.provenance.lights.push_back(build_.source_of(-1, relation.offset));
  }

  /// Returns the first junction on the lanes behind a light's stop line, or -1 if there is none.
  int32_t junction_ahead(const Approach& approach) const {
    std::vector<std::pair<int32_t, float>> ahead;  // lanes, and the distance to their start
    std::set<int32_t> known(approach.connecting.begin(), approach.connecting.end());
    for (const int32_t lane : approach.connecting) ahead.emplace_back(lane, 0.0f);
    for (std::size_t i = 0; i < ahead.size(); ++i) {
      const auto [index, way_m] = ahead[i];
      const Lane& lane = map_.lanes[index];
      if (lane.junction >= 0) return lane.junction;
      if (way_m + lane.length_m > kJunctionAhead_m) continue;
      for (const int32_t next : map_.links(lane.successors)) {
        build_.budget.count_sample();
        if (known.insert(next).second) ahead.emplace_back(next, way_m + lane.length_m);
      }
    }
    for (const int32_t lane : approach.incoming) {
      if (map_.lanes[lane].junction >= 0) return map_.lanes[lane].junction;
    }
    return -1;
  }

  /// Sets the light's head to the head that is farthest ahead, because waiting vehicles can see it.
  void set_head(const Approach& approach, Vec2 forward, TrafficLight* light) const {
    const Vec3 middle = (light->stop_a_m + light->stop_b_m) * 0.5f;
    float best_m = -std::numeric_limits<float>::infinity();
    for (const int32_t way : approach.heads) {
      const Vec3 center = center_of(way);
      const float ahead_m = dot((center - middle).xy(), forward);
      if (ahead_m <= best_m) continue;
      best_m = ahead_m;
      light->head_m = center;
    }
    if (light->head_m.z - middle.z < kLowestHead_m) {
      light->head_m.z = middle.z + (best_m > kFarHead_m ? kFarHeadHeight_m : kNearHeadHeight_m);
    }
  }

  /// Adds the ways that are traffic signs, with the lanes of the regulatory elements that refer to them.
  void add_signs() {
    std::map<int32_t, std::vector<int32_t>> lanes_of_sign;
    for (std::size_t i = 0; i < file_.relations.size(); ++i) {
      for (const int32_t way : file_.relations[i].ways("refers")) {
        if (file_.ways[way].tags.of("type") != "traffic_sign") continue;
        std::vector<int32_t>& lanes = lanes_of_sign[way];
        lanes.insert(lanes.end(), lanes_of_rule_[i].begin(), lanes_of_rule_[i].end());
        build_.count_work(lanes_of_rule_[i].size());
      }
    }
    for (auto& [way, lanes] : lanes_of_sign) sort_unique(&lanes);
    for (std::size_t i = 0; i < file_.ways.size(); ++i) {
      const Way& way = file_.ways[i];
      if (way.tags.of("type") != "traffic_sign" || way.nodes.size() < 2) continue;
      const auto index = static_cast<int32_t>(i);
      Sign sign{.name = std::to_string(way.id)};
      set_type(way.tags.of("subtype"), &sign);
      sign.position_m = center_of(index);
      // The line of a sign runs from the sign's left edge to its right edge, as seen by traffic.
      const Points line = build_.points_of(index);
      const Eigen::Vector2d right = (line.back() - line.front()).head<2>();
      sign.heading_rad = static_cast<float>(std::atan2(right.x(), -right.y()));
      const std::vector<int32_t>& lanes = lanes_of_sign[index];
      if (!lanes.empty()) sign.heading_rad = heading_beside(lanes.front(), sign.position_m);
      sign.lanes.begin = static_cast<int32_t>(map_.sign_lanes.size());
      map_.sign_lanes.insert(map_.sign_lanes.end(), lanes.begin(), lanes.end());
      sign.lanes.end = static_cast<int32_t>(map_.sign_lanes.size());
      map_.signs.push_back(sign);
      map_.provenance.signs.push_back(build_.source_of(-1, way.offset));
    }
  }

  float heading_beside(int32_t lane, Vec3 p) const {
    const Span<const LanePoint> points = map_.points_of(map_.lanes[lane]);
    return std::min_element(points.begin(), points.end(),
                            [&](const LanePoint& a, const LanePoint& b) {
                              return length(a.position_m - p) < length(b.position_m - p);
                            })
        ->heading_rad;
  }

  /// Sets a sign's type from a subtype such as de206 or usR1-1, which consists of region and number. Autoware's
  /// stop_sign becomes 206 of OpenDRIVE's catalogue.
  static void set_type(std::string_view subtype, Sign* sign) {
    if (subtype == "stop_sign") {
      sign->type = "206";
      sign->country = "OpenDRIVE";
      return;
    }
    const auto is_lower = [](char c) { return c >= 'a' && c <= 'z'; };
    const bool has_region = subtype.size() > 2 && is_lower(subtype[0]) && is_lower(subtype[1]) && !is_lower(subtype[2]);
    if (has_region) {
      for (const char c : subtype.substr(0, 2)) sign->country.push_back(static_cast<char>(c - 'a' + 'A'));
      subtype.remove_prefix(2);
    }
    const std::size_t dash = subtype.find('-');
    const bool is_split = dash != std::string_view::npos && sign->country == "DE";
    sign->type = subtype.substr(0, is_split ? dash : std::string_view::npos);
    sign->subtype = is_split ? subtype.substr(dash + 1) : "-1";
  }

  Build& build_;
  RoadMap& map_;
  const OsmFile& file_;
  std::vector<std::vector<int32_t>> lanes_of_rule_;  // [relations]
  std::vector<bool> is_referred_to_;                 // [relations] whether a lanelet of any kind refers to the relation
  std::map<std::vector<int32_t>, Approach> approaches_;  // by stop line, or by heads
  std::map<int32_t, std::vector<double>> axes_;          // by junction: headings of the first light of each phase
};

}  // namespace

void build_rules(Build* build) { RuleBuilder(build).run(); }

void count_facts(Build* build) {
  RoadMap& map = *build->map;
  MapFacts facts;
  facts.roads = static_cast<int32_t>(map.road_names.size());
  facts.junctions = static_cast<int32_t>(map.junctions.size());
  facts.signal_junctions = static_cast<int32_t>(std::count_if(
      map.junctions.begin(), map.junctions.end(), [](const Junction& junction) { return junction.num_phases > 0; }));
  facts.lanes = static_cast<int32_t>(map.lanes.size());
  facts.z_min_m = std::numeric_limits<double>::infinity();
  facts.z_max_m = -facts.z_min_m;
  for (const Lane& lane : map.lanes) {
    facts.junction_roads += lane.in_junction && lane.source_lane > 0;
    for (const LanePoint& point : map.points_of(lane)) {
      const double z_m = static_cast<double>(point.position_m.z) + map.origin_m[2];
      facts.z_min_m = std::min(facts.z_min_m, z_m);
      facts.z_max_m = std::max(facts.z_max_m, z_m);
    }
    if (lane.type != LaneType::driving) continue;
    ++facts.driving_lanes;
    facts.driving_lane_km += 1e-3 * static_cast<double>(lane.length_m);
    if (lane.in_junction) facts.driving_lane_km_in_junctions += 1e-3 * static_cast<double>(lane.length_m);
  }
  facts.traffic_lights = facts.stop_lines = static_cast<int32_t>(map.lights.size());
  facts.crosswalks = static_cast<int32_t>(map.crosswalks.size());
  facts.parking_spaces = static_cast<int32_t>(map.parking_spaces.size());
  facts.painted_stop_lines = static_cast<int32_t>(map.stop_lines.size());
  facts.signs = static_cast<int32_t>(map.signs.size());
  map.facts = facts;
}

}  // namespace pictura::lanelet2
