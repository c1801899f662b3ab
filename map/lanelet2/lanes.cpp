// Builds the lanes of a Lanelet2 map from pairs of borders: centre lines, links, neighbours, junctions and speed
// limits.
#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>

#include "pictura/common/error.h"
#include "pictura/common/scene.h"
#include "pictura/map/lanelet2/build.h"
#include "pictura/map/polyline_lanes.h"
#include "pictura/map/speed_limit.h"

namespace pictura::lanelet2 {

namespace {

constexpr double kSameOutlinePoint_m = 0.01;
constexpr double kMaxWidth_m = 500.0;
constexpr double kMaxRadius_m = 50e3;  // maximum distance of a map's points from its origin, along each axis
constexpr float kBridged_m = 20.0f;    // maximum length of a lanelet between two lanelets of a junction

/// Returns a positive number if `p` is on the left of the line. If a corner of the line is nearest, the sum of the
/// normals before and after the corner decides.
double side_of(const Points& line, const Eigen::Vector3d& p) {
  double best_m = std::numeric_limits<double>::infinity(), side = 0;
  const auto normal_of = [&](std::size_t i) {
    const Eigen::Vector2d way = (line[i + 1] - line[i]).head<2>();
    return Eigen::Vector2d(-way.y(), way.x()).normalized().eval();
  };
  for (std::size_t i = 0; i + 1 < line.size(); ++i) {
    const Eigen::Vector2d way = (line[i + 1] - line[i]).head<2>();
    const double length2 = way.squaredNorm();
    if (length2 == 0) continue;
    const double t = std::clamp((p - line[i]).head<2>().dot(way) / length2, 0.0, 1.0);
    const Eigen::Vector2d away = (p - line[i]).head<2>() - t * way;
    if (away.norm() >= best_m) continue;
    best_m = away.norm();
    Eigen::Vector2d normal = normal_of(i);
    if (t == 0 && i > 0) normal += normal_of(i - 1);
    if (t == 1 && i + 2 < line.size()) normal += normal_of(i + 1);
    side = away.dot(normal);
  }
  return side;
}

Eigen::Vector3d middle_of(const Points& line) {
  return line.size() > 2 ? line[line.size() / 2] : (0.5 * (line.front() + line.back())).eval();
}

/// Returns the length in plan from the start to each point, as a fraction of the whole length.
std::vector<double> fractions_of(const Points& line) {
  std::vector<double> fractions{0};
  for (std::size_t i = 1; i < line.size(); ++i) {
    fractions.push_back(fractions.back() + plan_distance_m(line[i - 1], line[i]));
  }
  const double whole = fractions.back();
  for (double& fraction : fractions) fraction = whole > 0 ? fraction / whole : 0;
  return fractions;
}

/// Returns the points at ascending fractions of a line's length. `own` contains the fractions of the line's own points.
Points points_at(const Points& line, const std::vector<double>& own, const std::vector<double>& fractions) {
  Points points;
  std::size_t next = 1;
  for (const double fraction : fractions) {
    while (next + 1 < line.size() && own[next] < fraction) ++next;
    const double span = own[next] - own[next - 1];
    const double t = span > 0 ? std::clamp((fraction - own[next - 1]) / span, 0.0, 1.0) : 1.0;
    points.push_back(line[next - 1] + t * (line[next] - line[next - 1]));
  }
  return points;
}

enum class Use : uint8_t { lane, crosswalk };

struct Kind {
  Use use = Use::lane;
  LaneType type = LaneType::driving;
};

/// Returns the lane type of a subtype; nullopt for unknown subtypes.
std::optional<LaneType> type_of_subtype(std::string_view subtype) {
  static const std::map<std::string_view, LaneType> types{
      {"", LaneType::driving},
      {"road", LaneType::driving},
      {"highway", LaneType::driving},
      {"play_street", LaneType::driving},
      {"exit", LaneType::driving},
      {"bus_lane", LaneType::driving},
      {"parking", LaneType::parking},
      {"emergency_lane", LaneType::restricted},
      {"rail", LaneType::restricted},
      {"road_shoulder", LaneType::shoulder},
      {"bicycle_lane", LaneType::biking},
      {"walkway", LaneType::sidewalk},
      {"shared_walkway", LaneType::sidewalk},
      {"pedestrian_lane", LaneType::sidewalk},
      {"stairs", LaneType::sidewalk},
  };
  const auto found = types.find(subtype);
  return found == types.end() ? std::nullopt : std::optional(found->second);
}

/// Whether a tag participant:NAME with the value yes covers the participant. For example, vehicle covers vehicle:car.
bool is_allowed(const Tags& tags, std::string_view participant) {
  constexpr std::string_view kPrefix = "participant:";
  return std::any_of(tags.begin(), tags.end(), [&](const auto& tag) {
    if (!tag.first.starts_with(kPrefix) || flag_of(tag.second) != true) return false;
    const std::string_view who = tag.first.substr(kPrefix.size());
    return participant.starts_with(who) || who.starts_with(participant);
  });
}

/// Returns the lane type that the tags participant:* define, or nullopt if there are none.
std::optional<LaneType> type_of_participants(const Tags& tags) {
  if (std::none_of(tags.begin(), tags.end(), [](const auto& tag) { return tag.first.starts_with("participant:"); })) {
    return std::nullopt;
  }
  for (const std::string_view vehicle : {"vehicle:car", "vehicle:bus", "vehicle:taxi", "vehicle:truck"}) {
    if (is_allowed(tags, vehicle)) return LaneType::driving;
  }
  if (is_allowed(tags, "vehicle")) return LaneType::restricted;
  if (is_allowed(tags, "bicycle")) return LaneType::biking;
  return is_allowed(tags, "pedestrian") ? LaneType::sidewalk : LaneType::restricted;
}

/// Returns the speed limit of a lane for which the file has none. The limits are Germany's, because Lanelet2's own
/// rules follow them. A missing location counts as urban, as in Lanelet2.
double default_speed_mps(const Tags& tags) {
  const std::string_view subtype = tags.of("subtype"), location = tags.of("location");
  const bool is_nonurban = location == "nonurban";
  if (!is_nonurban && location != "urban" && !location.empty()) return double{kDefaultSpeedLimit_mps};
  if (subtype == "highway") return 130 / 3.6;
  if (subtype == "play_street") return 7 / 3.6;
  if (subtype.empty() || subtype == "road" || subtype == "bus_lane" || subtype == "exit") {
    return (is_nonurban ? 100 : 50) / 3.6;
  }
  return double{kDefaultSpeedLimit_mps};
}

/// Returns the speed limit of a German sign: 274-50 limits to 50 km/h, 274_1 begins a 30 km/h zone, 310 begins a town.
std::optional<double> speed_of_sign_mps(std::string_view sign) {
  if (sign == "de310") return 50 / 3.6;
  if (!sign.starts_with("de274")) return parse_speed_mps(sign);
  const std::size_t dash = sign.find('-');
  return dash == std::string_view::npos ? 30 / 3.6 : parse_speed_mps(sign.substr(dash + 1));
}

class LaneBuilder {
 public:
  explicit LaneBuilder(Build* build) : build_(*build), map_(*build->map), file_(build->file) {}

  void run() {
    for (Lanelet& lanelet : build_.lanelets) {
      build_.budget.work().check();
      add_lanelet(&lanelet);
    }
    if (map_.lanes.empty()) fail("{}: expected a lanelet that is no crosswalk, found none", file_.source.name());
    link();
    set_neighbors();
    find_crossing_junctions([](const Lane& lane) { return lane.type == LaneType::driving; }, kBridged_m,
                            [this](std::size_t) { build_.budget.count_sample(); }, &map_);
    map_.provenance.junctions.assign(map_.junctions.size(), SourceElement{});
  }

 private:
  void add_lanelet(Lanelet* lanelet) {
    const Relation& relation = build_.relation_of(*lanelet);
    const Points left = build_.points_of(lanelet->left), right = build_.points_of(lanelet->right);
    if (relation.tags.of("subtype") == "crosswalk") return add_crosswalk(relation, left, right);
    const std::vector<double> left_at = fractions_of(left), right_at = fractions_of(right);
    Points center;
    const std::vector<int32_t> stated = relation.ways("centerline");
    if (stated.size() == 1 && file_.ways[stated[0]].nodes.size() >= 2) {
      center = build_.points_of(stated[0]);
      if (plan_distance_m(center.front(), left.front()) > plan_distance_m(center.back(), left.front())) {
        std::reverse(center.begin(), center.end());
      }
    }
    std::vector<double> fractions = left_at;
    fractions.insert(fractions.end(), right_at.begin(), right_at.end());
    const std::vector<double> center_at = center.empty() ? std::vector<double>{} : fractions_of(center);
    fractions.insert(fractions.end(), center_at.begin(), center_at.end());
    std::sort(fractions.begin(), fractions.end());
    fractions.erase(std::unique(fractions.begin(), fractions.end(), [](double a, double b) { return b - a < 1e-7; }),
                    fractions.end());
    SurfaceBand band{points_at(left, left_at, fractions), points_at(right, right_at, fractions)};
    const Points center_points = center.empty() ? Points{} : points_at(center, center_at, fractions);
    std::vector<CurvePoint> line;
    for (std::size_t i = 0; i < fractions.size(); ++i) {
      if (plan_distance_m(band.left[i], band.right[i]) > kMaxWidth_m) {
        file_.where(relation).fail("expected borders at most {} m apart, got {:.1f} m", kMaxWidth_m,
                                   plan_distance_m(band.left[i], band.right[i]));
      }
      line.push_back({fractions[i], center.empty() ? (0.5 * (band.left[i] + band.right[i])).eval() : center_points[i]});
    }
    set_widths(band, &line);
    line = cut_line(line, &build_.budget);
    if (line.size() < 2) {
      return file_.where(relation).record_repair(build_.faults, RepairKind::empty_lanelet,
                                                 "its center line has no length");
    }
    std::vector<CurvePoint> points;
    for (const std::size_t index : thin_polyline(line, double{build_.options.chord_error_m}, double{kMaxPiece_m})) {
      points.push_back(line[index]);
    }
    lanelet->road = static_cast<int32_t>(map_.road_names.size());
    map_.road_names.push_back(std::to_string(relation.id));
    const LaneType type = type_of(relation);
    const double limit_mps = speed_limit_mps(relation);
    lanelet->lane = add_lane(*lanelet, type, limit_mps, points, false);
    if (type == LaneType::driving && is_two_way(relation.tags)) {
      std::reverse(points.begin(), points.end());
      lanelet->back = add_lane(*lanelet, type, limit_mps, points, true);
    }
    if (!is_drivable(type)) return;
    build_.bands.push_back(std::move(band));
    build_.band_roads.push_back(lanelet->road);
  }

  /// Sets the widths of a lane to the distance between its borders, perpendicular to the centre line.
  static void set_widths(const SurfaceBand& band, std::vector<CurvePoint>* line) {
    std::vector<CurvePoint>& points = *line;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const std::size_t before = i > 0 ? i - 1 : 0, after = std::min(i + 1, points.size() - 1);
      const Eigen::Vector2d way = (points[after].position_m - points[before].position_m).head<2>().normalized();
      const Eigen::Vector2d across = (band.left[i] - band.right[i]).head<2>();
      points[i].width = std::abs(way.x() * across.y() - way.y() * across.x());
    }
  }

  LaneType type_of(const Relation& relation) const {
    const std::string_view subtype = relation.tags.of("subtype");
    const std::optional<LaneType> by_subtype = type_of_subtype(subtype);
    if (by_subtype == LaneType::shoulder || by_subtype == LaneType::parking) return *by_subtype;
    if (const std::optional<LaneType> stated = type_of_participants(relation.tags)) return *stated;
    if (!by_subtype) {
      file_.where(relation).record_repair(build_.faults, RepairKind::unknown_subtype, "tag subtype: '{}' is not known",
                                          subtype);
    }
    return by_subtype.value_or(LaneType::other);
  }

  static bool is_two_way(const Tags& tags) {
    for (const std::string_view key : {"one_way", "one_way:vehicle", "one_way:vehicle:car"}) {
      if (tags.flag(key) == false) return true;
    }
    return false;
  }

  int32_t add_lane(const Lanelet& lanelet, LaneType type, double limit_mps, const std::vector<CurvePoint>& points,
                   bool is_back) {
    const Relation& relation = build_.relation_of(lanelet);
    Lane lane{.type = type};
    lane.in_junction = type == LaneType::driving && relation.tags.has("turn_direction");  // tag of Autoware
    lane.speed_limit_mps = static_cast<float>(limit_mps);
    lane.source_road = lanelet.road;
    lane.source_lane = is_back ? -1 : 1;
    append_lane_points(points, &map_, &lane);
    map_.lanes.push_back(lane);
    map_.provenance.lanes.push_back(build_.source_of(lanelet.road, relation.offset));
    build_.lane_sides.emplace_back(is_back ? lanelet.right.reversed() : lanelet.left,
                                   is_back ? lanelet.left.reversed() : lanelet.right);
    return static_cast<int32_t>(map_.lanes.size()) - 1;
  }

  /// Returns the speed limit of a regulatory element if there is one, else of the lanelet's tags, else of its subtype
  /// and location.
  double speed_limit_mps(const Relation& relation) {
    for (const int32_t index : relation.relations("regulatory_element")) {
      const Relation& rule = file_.relations[index];
      if (rule.tags.of("subtype") != "speed_limit" || rule.tags.flag("dynamic") == true) continue;
      build_.count_work(rule.members.size());
      std::string_view stated = rule.tags.of("sign_type");
      for (const int32_t way : rule.ways("refers")) {
        if (stated.empty()) stated = file_.ways[way].tags.of("subtype");
      }
      if (const std::optional<double> mps = speed_of_sign_mps(stated)) return *mps;
      if (!unreadable_rules_.insert(index).second) continue;  // recorded for another lanelet
      file_.where(rule).record_repair(build_.faults, RepairKind::unreadable_speed,
                                      "expected a speed limit like '50 km/h', got '{}'", stated);
    }
    for (const std::string_view key : {"speed_limit:vehicle:car", "speed_limit:vehicle", "speed_limit"}) {
      const std::string_view stated = relation.tags.of(key);
      if (stated.empty()) continue;
      if (const std::optional<double> mps = parse_speed_mps(stated)) return *mps;
      file_.where(relation).record_repair(build_.faults, RepairKind::unreadable_speed,
                                          "tag {}: expected a speed limit like '50 km/h', got '{}'", key, stated);
    }
    return default_speed_mps(relation.tags);
  }

  void add_crosswalk(const Relation& relation, const Points& left, const Points& right) {
    std::vector<Vec3> ring;
    const auto add = [&](const Eigen::Vector3d& p) {
      const Vec3 point = to_vec3(p);
      if (ring.empty() || length(point - ring.back()) > static_cast<float>(kSameOutlinePoint_m)) ring.push_back(point);
    };
    for (const Eigen::Vector3d& p : left) add(p);
    for (std::size_t i = right.size(); i-- > 0;) add(right[i]);
    if (ring.size() > 1 && length(ring.back() - ring.front()) <= static_cast<float>(kSameOutlinePoint_m))
      ring.pop_back();
    if (ring.size() < 3) {
      return file_.where(relation).record_repair(build_.faults, RepairKind::empty_lanelet,
                                                 "expected a crosswalk with an area");
    }
    const auto first = static_cast<int32_t>(map_.outline_points.size());
    map_.outline_points.insert(map_.outline_points.end(), ring.begin(), ring.end());
    map_.crosswalks.push_back({{first, static_cast<int32_t>(map_.outline_points.size())}});
    map_.provenance.crosswalks.push_back(build_.source_of(-1, relation.offset));
  }

  /// Links lanes. A lane follows another lane if its borders begin at the points at which the other lane's borders end.
  void link() {
    std::map<std::pair<int32_t, int32_t>, std::vector<int32_t>> starts;
    for (std::size_t i = 0; i < map_.lanes.size(); ++i) {
      const auto& [left, right] = build_.lane_sides[i];
      starts[{build_.first_node(left), build_.first_node(right)}].push_back(static_cast<int32_t>(i));
    }
    LaneLinks links;
    for (std::size_t i = 0; i < map_.lanes.size(); ++i) {
      const auto& [left, right] = build_.lane_sides[i];
      const auto found = starts.find({build_.last_node(left), build_.last_node(right)});
      if (found == starts.end()) continue;
      for (const int32_t next : found->second) {
        build_.budget.count_sample();
        const LaneType a = map_.lanes[i].type, b = map_.lanes[next].type;
        if (next == static_cast<int32_t>(i) || !(a == b || (is_drivable(a) && is_drivable(b)))) continue;
        links.emplace(static_cast<int32_t>(i), next);
      }
    }
    set_lane_links(links, &map_);
  }

  /// Whether traffic may cross the line in at least one direction.
  static bool allows_lane_change(const Tags& tags) {
    if (const std::optional<bool> stated = tags.flag("lane_change")) return *stated;
    const std::optional<bool> left = tags.flag("lane_change:left"), right = tags.flag("lane_change:right");
    if (left || right) return left == true || right == true;
    const std::string_view type = tags.of("type"), subtype = tags.of("subtype");
    if (type != "line_thin" && type != "line_thick") return false;
    return subtype == "dashed" || subtype == "dashed_solid" || subtype == "solid_dashed";
  }

  /// Sets the neighbours of lanes. Neighbours have the same direction, and share a border that traffic may cross.
  void set_neighbors() {
    std::map<Border, std::vector<int32_t>> lanes_left_of;
    const auto is_route = [&](int32_t lane) { return map_.lanes[lane].type == LaneType::driving; };
    for (std::size_t i = 0; i < map_.lanes.size(); ++i) {
      const auto lane = static_cast<int32_t>(i);
      if (is_route(lane)) lanes_left_of[build_.lane_sides[i].second].push_back(lane);
    }
    for (std::size_t i = 0; i < map_.lanes.size(); ++i) {
      const auto lane = static_cast<int32_t>(i);
      const Border& left = build_.lane_sides[i].first;
      if (!is_route(lane) || !allows_lane_change(file_.ways[left.way].tags)) continue;
      const auto found = lanes_left_of.find(left);
      if (found == lanes_left_of.end()) continue;
      for (const int32_t other : found->second) {
        build_.budget.count_sample();
        if (other == lane || map_.lanes[other].right_neighbor >= 0 || is_leftmost_of(lane, other)) continue;
        map_.lanes[lane].left_neighbor = other;
        map_.lanes[other].right_neighbor = lane;
        break;
      }
    }
  }

  /// Whether `lane` is `other` or a lane on the left of `other`. Then `other` must not become the left neighbour of
  /// `lane`, because the neighbours would form a ring.
  bool is_leftmost_of(int32_t lane, int32_t other) {
    while (other >= 0 && other != lane) {
      other = map_.lanes[other].left_neighbor;
      build_.budget.count_sample();
    }
    return other == lane;
  }

  Build& build_;
  RoadMap& map_;
  const OsmFile& file_;
  std::set<int32_t> unreadable_rules_;  // speed limits that are already recorded
};

}  // namespace

Points Build::points_of(const Border& border) {
  count_work(file.ways[border.way].nodes.size());
  Points points;
  for (const int32_t node : file.ways[border.way].nodes) points.push_back(from_origin(file.nodes[node].position_m));
  if (border.is_reversed) std::reverse(points.begin(), points.end());
  return points;
}

Eigen::Vector3d point_at_fraction(const Points& line, double fraction) {
  return points_at(line, fractions_of(line), {fraction}).front();
}

std::vector<CurvePoint> cut_line(const std::vector<CurvePoint>& line, SampleBudget* budget) {
  std::vector<CurvePoint> cut;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const CurvePoint& next = line[i];
    if (!cut.empty()) {
      const CurvePoint last = cut.back();
      const double way_m = plan_distance_m(last.position_m, next.position_m);
      if (way_m < kSameOutlinePoint_m) {
        // The last point is kept exactly, because other lines may begin there.
        if (i + 1 == line.size() && cut.size() > 1) cut.back() = next;
        continue;
      }
      const int pieces = static_cast<int>(std::ceil(way_m / double{kMaxPiece_m} - kPieceRounding));
      for (int k = 1; k < pieces; ++k) {
        budget->count_sample();
        const double t = static_cast<double>(k) / pieces;
        cut.push_back({last.s + t * (next.s - last.s), last.position_m + t * (next.position_m - last.position_m),
                       last.width + t * (next.width - last.width)});
      }
    }
    budget->count_sample();
    cut.push_back(next);
  }
  return cut;
}

std::vector<CurvePoint> cut_line(const Points& line, SampleBudget* budget) {
  std::vector<CurvePoint> points;
  for (const Eigen::Vector3d& p : line) points.push_back({0, p, 0});
  return cut_line(points, budget);
}

bool is_for_vehicles(const Tags& tags) {
  const std::optional<LaneType> type = type_of_participants(tags);
  return (type ? type : type_of_subtype(tags.of("subtype"))) == LaneType::driving;
}

void find_lanelets(Build* build) {
  const OsmFile& file = build->file;
  build->lanelet_of_relation.assign(file.relations.size(), -1);
  std::vector<double> xs, ys, zs;
  for (std::size_t i = 0; i < file.relations.size(); ++i) {
    const Relation& relation = file.relations[i];
    if (relation.tags.of("type") != "lanelet") continue;
    const std::vector<int32_t> left = relation.ways("left"), right = relation.ways("right");
    const auto is_line = [&](int32_t way) { return file.ways[way].nodes.size() >= 2; };
    if (left.size() != 1 || right.size() != 1 || !is_line(left[0]) || !is_line(right[0])) {
      file.where(relation).record_repair(build->faults, RepairKind::borderless_lanelet,
                                         "expected one left and one right border, each of at least two points, got {} "
                                         "and {}, of which {} and {} have two points",
                                         left.size(), right.size(), std::count_if(left.begin(), left.end(), is_line),
                                         std::count_if(right.begin(), right.end(), is_line));
      continue;
    }
    Lanelet lanelet{.relation = static_cast<int32_t>(i), .left = {left[0]}, .right = {right[0]}};
    // As in Lanelet2, the left border is reversed if the middle of the right border is not on its right. The right
    // border is reversed if the middle of the left border is not on its left.
    if (side_of(build->points_of(lanelet.left), middle_of(build->points_of(lanelet.right))) >= 0) {
      lanelet.left.is_reversed = true;
    }
    if (side_of(build->points_of(lanelet.right), middle_of(build->points_of(lanelet.left))) <= 0) {
      lanelet.right.is_reversed = true;
    }
    for (const int32_t way : {left[0], right[0]}) {
      for (const int32_t node : file.ways[way].nodes) {
        xs.push_back(file.nodes[node].position_m.x());
        ys.push_back(file.nodes[node].position_m.y());
        zs.push_back(file.nodes[node].position_m.z());
      }
    }
    build->lanelet_of_relation[i] = static_cast<int32_t>(build->lanelets.size());
    build->lanelets.push_back(lanelet);
  }
  if (build->lanelets.empty()) fail("{}: expected a lanelet, found none", file.source.name());
  std::array<double, 3>& origin_m = build->map->origin_m;
  std::array<std::vector<double>*, 3> axes{&xs, &ys, &zs};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto [low, high] = std::minmax_element(axes[axis]->begin(), axes[axis]->end());
    origin_m[axis] = std::round(0.5 * (*low + *high)) + 0.0;  // not -0
  }
  for (const Way& way : file.ways) {
    for (const int32_t index : way.nodes) {
      const Node& node = file.nodes[index];
      if (build->from_origin(node.position_m).head<2>().cwiseAbs().maxCoeff() <= kMaxRadius_m) continue;
      file.where(node).fail("expected coordinates within {} km of the map's center ({}, {}), got ({:.3f}, {:.3f})",
                            kMaxRadius_m / 1000, origin_m[0], origin_m[1], node.position_m.x(), node.position_m.y());
    }
  }
}

void build_lanes(Build* build) { LaneBuilder(build).run(); }

}  // namespace pictura::lanelet2
