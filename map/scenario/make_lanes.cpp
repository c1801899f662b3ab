// Makes the lanes of a scenario: centre lines, widths from borders, types, links, neighbours and junctions.
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <set>

#include "pictura/common/error.h"
#include "pictura/common/scene.h"
#include "pictura/map/endless_lanes.h"
#include "pictura/map/scenario/conversion.h"
#include "pictura/map/speed_limit.h"

namespace pictura::conversion {

namespace {

constexpr double kLaneWidth_m = 3.5, kBikeLaneWidth_m = 1.8;    // defaults for unknown widths
constexpr double kMinHalfWidth_m = 0.5, kMaxHalfWidth_m = 5.0;  // farther borders belong to other lanes
constexpr int32_t kWidthStride = 5;                             // points of a lane between measurements
// Maximum differences at the ends where a lane continues another lane.
constexpr double kMeetingEnds_m = 0.1, kMeetingHeading_rad = 1.05;
constexpr double kWideGap_m = 1.0;
constexpr float kMeetingLevel_m = 1.0f;

std::string place_of(const LoggedLane& lane) { return fmt::format("lane {}", lane.id); }

double distance_to(const Eigen::Vector2d& p, const LoggedPoints& line) {
  double best = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i + 1 < line.size(); ++i) {
    const Eigen::Vector2d a = line[i].head<2>(), way = line[i + 1].head<2>() - a;
    const double length2 = way.squaredNorm();
    const double t = length2 > 0 ? std::clamp((p - a).dot(way) / length2, 0.0, 1.0) : 0.0;
    best = std::min(best, (a + t * way - p).norm());
  }
  return best;
}

/// Measures the widths of lanes from the borders to which lanes refer.
class LaneWidthEstimator {
 public:
  explicit LaneWidthEstimator(Conversion* conversion) : conversion_(conversion) {
    for (const LoggedLine& line : conversion->scene.lines) features_.emplace(line.id, &line.points);
    for (const LoggedEdge& edge : conversion->scene.edges) features_.emplace(edge.id, &edge.points);
  }

  /// Returns the width at every point of a lane, or nothing if no border is known.
  std::optional<std::vector<double>> measure(const LoggedLane& lane) {
    if (!lane.widths_m.empty()) return lane.widths_m;
    std::map<std::size_t, double> left, right;  // half widths by point
    measure_side(lane, lane.left_boundaries, &left);
    measure_side(lane, lane.right_boundaries, &right);
    std::map<std::size_t, double> known = left;
    for (auto& [point, half] : known) half *= 2;
    for (const auto& [point, half] : right) {
      const auto other = left.find(point);
      known[point] = other == left.end() ? 2 * half : other->second + half;
    }
    if (known.empty()) return std::nullopt;
    return filled(known, lane.points.size());
  }

 private:
  void measure_side(const LoggedLane& lane, const std::vector<LoggedBoundary>& borders,
                    std::map<std::size_t, double>* halves_out) {
    for (const LoggedBoundary& border : borders) {
      const auto feature = features_.find(border.feature);
      if (feature == features_.end()) {
        conversion_->scene.note("borders that the map does not have", place_of(lane));
        continue;
      }
      const int32_t last = std::min(border.end, static_cast<int32_t>(lane.points.size()) - 1);
      for (int32_t i = std::max(border.begin, 0); i <= last;
           i = i < last ? std::min(i + kWidthStride, last) : last + 1) {
        conversion_->count_work(feature->second->size());
        const double half_m = distance_to(lane.points[i].head<2>(), *feature->second);
        if (half_m < kMinHalfWidth_m || half_m > kMaxHalfWidth_m) continue;
        const auto [at, is_new] = halves_out->emplace(static_cast<std::size_t>(i), half_m);
        if (!is_new) at->second = std::min(at->second, half_m);
      }
    }
  }

  /// Interpolates linearly between points with known widths. Beyond them, the width is constant.
  static std::vector<double> filled(const std::map<std::size_t, double>& known, std::size_t count) {
    std::vector<double> widths(count);
    auto next = known.begin();
    for (std::size_t i = 0; i < count; ++i) {
      while (next != known.end() && next->first < i) ++next;
      if (next == known.begin()) {
        widths[i] = next->second;
      } else if (next == known.end()) {
        widths[i] = std::prev(next)->second;
      } else {
        const auto before = std::prev(next);
        const double t = static_cast<double>(i - before->first) / static_cast<double>(next->first - before->first);
        widths[i] = before->second + t * (next->second - before->second);
      }
    }
    return widths;
  }

  Conversion* conversion_;
  std::unordered_map<int64_t, const LoggedPoints*> features_;
};

double mean_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

/// Sets the widths of lanes without borders. The width is the mean width of neighbours if known, else it follows from
/// the lanes before and after, else it is a constant.
void complete_widths(Conversion* conversion, std::vector<std::optional<std::vector<double>>>* widths_inout) {
  const LoggedScene& scene = conversion->scene;
  std::unordered_map<int64_t, const std::vector<double>*> measured;
  for (std::size_t i = 0; i < scene.lanes.size(); ++i) {
    if ((*widths_inout)[i]) measured.emplace(scene.lanes[i].id, &*(*widths_inout)[i]);
  }
  std::vector<std::vector<double>> completed(scene.lanes.size());
  for (std::size_t i = 0; i < scene.lanes.size(); ++i) {
    if ((*widths_inout)[i]) continue;
    const LoggedLane& lane = scene.lanes[i];
    std::vector<double> beside, at_begin, at_end;
    for (const auto* neighbors : {&lane.left_neighbors, &lane.right_neighbors}) {
      conversion->count_work(neighbors->size());
      for (const LoggedNeighbor& neighbor : *neighbors) {
        if (const auto found = measured.find(neighbor.lane); found != measured.end()) {
          conversion->count_work(found->second->size());
          beside.push_back(mean_of(*found->second));
        }
      }
    }
    conversion->count_work(lane.entries.size() + lane.exits.size());
    for (const int64_t id : lane.entries) {
      if (const auto found = measured.find(id); found != measured.end()) at_begin.push_back(found->second->back());
    }
    for (const int64_t id : lane.exits) {
      if (const auto found = measured.find(id); found != measured.end()) at_end.push_back(found->second->front());
    }
    double begin_m = lane.type == LoggedLaneType::bike ? kBikeLaneWidth_m : kLaneWidth_m, end_m = begin_m;
    if (!beside.empty()) {
      begin_m = end_m = mean_of(beside);
    } else if (!at_begin.empty() || !at_end.empty()) {
      begin_m = mean_of(at_begin.empty() ? at_end : at_begin);
      end_m = mean_of(at_end.empty() ? at_begin : at_end);
    }
    const std::size_t count = lane.points.size();
    for (std::size_t k = 0; k < count; ++k) {
      const double t = count > 1 ? static_cast<double>(k) / static_cast<double>(count - 1) : 0;
      completed[i].push_back(begin_m + t * (end_m - begin_m));
    }
  }
  for (std::size_t i = 0; i < scene.lanes.size(); ++i) {
    if (!(*widths_inout)[i]) (*widths_inout)[i] = std::move(completed[i]);
  }
}

LaneType type_of(LoggedLaneType type) {
  switch (type) {
    case LoggedLaneType::freeway:
    case LoggedLaneType::surface:
    case LoggedLaneType::bus: return LaneType::driving;
    case LoggedLaneType::bike: return LaneType::biking;
    case LoggedLaneType::undefined: break;
  }
  return LaneType::other;
}

/// Returns the links of the file. Either of the two linked lanes may contain the link.
LaneLinks given_links(Conversion* conversion) {
  LoggedScene& scene = conversion->scene;
  const RoadMap& map = conversion->out->map;
  LaneLinks links;
  const auto add = [&](int64_t from_id, int64_t to_id, const LoggedLane& stated_by) {
    const auto from = conversion->lane_of_id.find(from_id), to = conversion->lane_of_id.find(to_id);
    if (from == conversion->lane_of_id.end() || to == conversion->lane_of_id.end()) {
      scene.note("links to lanes that the map does not have left out", place_of(stated_by));
      return;
    }
    if (from_id == to_id) return;
    const int32_t a = from->second, b = to->second;
    const float gap_m = length(end_of(map, a).position_m - start_of(map, b).position_m);
    const float other_m = length(end_of(map, b).position_m - start_of(map, a).position_m);
    if (!scene.is_authored && gap_m > kWideGap_m && other_m < kMeetingEnds_m) {
      if (links.emplace(b, a).second)
        scene.note("links whose lanes meet the other way round swapped", place_of(stated_by));
      return;
    }
    if (links.emplace(a, b).second && gap_m > kWideGap_m) {
      scene.note("links over a gap of more than 1 m kept", place_of(stated_by));
    }
  };
  for (const std::size_t index : conversion->logged_lane) {
    const LoggedLane& lane = scene.lanes[index];
    conversion->count_work(20 * (lane.entries.size() + lane.exits.size()));
    for (const int64_t other : lane.entries) add(other, lane.id, lane);
    for (const int64_t other : lane.exits) add(lane.id, other, lane);
    // The link of a lane to itself is both an entry and an exit.
    const auto has_itself = [&](const std::vector<int64_t>& ids) {
      return std::find(ids.begin(), ids.end(), lane.id) != ids.end();
    };
    if (has_itself(lane.entries) || has_itself(lane.exits)) {
      scene.note("links of a lane to itself left out", place_of(lane));
    }
  }
  return links;
}

/// Returns links from each lane to the lanes that start where it ends, in about the same direction.
LaneLinks meeting_links(Conversion* conversion) {
  const RoadMap& map = conversion->out->map;
  std::vector<Aabb2> starts;
  constexpr float kReach_m = static_cast<float>(kMeetingEnds_m);
  const auto box_around = [](Vec3 p) {
    return Aabb2{{p.x - kReach_m, p.y - kReach_m}, {p.x + kReach_m, p.y + kReach_m}};
  };
  for (std::size_t i = 0; i < map.lanes.size(); ++i) {
    starts.push_back(box_around(start_of(map, static_cast<int32_t>(i)).position_m));
  }
  const Grid grid(starts, 10.0f);
  LaneLinks links;
  for (std::size_t i = 0; i < map.lanes.size(); ++i) {
    const LanePoint& end = end_of(map, static_cast<int32_t>(i));
    visit_items(grid.view(), box_around(end.position_m), [&](std::size_t other) {
      conversion->count_work(20);
      const LanePoint& start = start_of(map, static_cast<int32_t>(other));
      const Vec3 gap = start.position_m - end.position_m;
      if (other == i || length(gap.xy()) > kReach_m || std::abs(gap.z) > kMeetingLevel_m) return;
      if (std::abs(wrap_angle(start.heading_rad - end.heading_rad)) > static_cast<float>(kMeetingHeading_rad)) return;
      links.emplace(static_cast<int32_t>(i), static_cast<int32_t>(other));
    });
  }
  return links;
}

/// Returns the neighbour with the longest common part, or -1.
int32_t longest_neighbor(Conversion* conversion, const std::vector<LoggedNeighbor>& neighbors, int32_t own) {
  std::map<int32_t, int64_t> lengths;
  conversion->count_work(10 * neighbors.size());
  for (const LoggedNeighbor& neighbor : neighbors) {
    const auto found = conversion->lane_of_id.find(neighbor.lane);
    if (found == conversion->lane_of_id.end() || found->second == own) continue;
    lengths[found->second] += std::max<int64_t>(0, int64_t{neighbor.end} - neighbor.begin) + 1;
  }
  int32_t best = -1;
  for (const auto& [lane, points] : lengths) {
    if (best < 0 || points > lengths[best]) best = lane;
  }
  return best;
}

/// Sets the neighbours of lanes. Two lanes become neighbours if each refers to the other, and if their types are equal
/// or, in authored scenes, those of routes.
void set_neighbors(Conversion* conversion) {
  RoadMap& map = conversion->out->map;
  std::vector<int32_t> left(map.lanes.size()), right(map.lanes.size());
  for (std::size_t i = 0; i < map.lanes.size(); ++i) {
    const LoggedLane& lane = conversion->scene.lanes[conversion->logged_lane[i]];
    left[i] = longest_neighbor(conversion, lane.left_neighbors, static_cast<int32_t>(i));
    right[i] = longest_neighbor(conversion, lane.right_neighbors, static_cast<int32_t>(i));
  }
  for (std::size_t i = 0; i < map.lanes.size(); ++i) {
    const int32_t other = left[i];
    if (other < 0 || right[other] != static_cast<int32_t>(i)) continue;
    const LaneType type = map.lanes[i].type, other_type = map.lanes[other].type;
    const bool are_authored_routes = conversion->scene.is_authored && is_route(type) && is_route(other_type);
    if (type != other_type && !are_authored_routes) continue;
    // Skips neighbours that would form a ring, because a ring has no leftmost lane.
    int32_t leftmost = other;
    while (leftmost >= 0 && leftmost != static_cast<int32_t>(i)) {
      leftmost = map.lanes[leftmost].left_neighbor;
      conversion->count_work(1);
    }
    if (leftmost >= 0) continue;
    map.lanes[i].left_neighbor = other;
    map.lanes[other].right_neighbor = static_cast<int32_t>(i);
  }
}

/// Sets the type of each lane without a type to the type of the linked lanes, if all of them have the same type.
void infer_types(RoadMap* map) {
  std::vector<LaneType> types;
  for (const Lane& lane : map->lanes) {
    std::set<LaneType> linked;
    if (lane.type == LaneType::other) {
      for (const IndexRange range : {lane.successors, lane.predecessors}) {
        for (const int32_t other : map->links(range)) linked.insert(map->lanes[other].type);
      }
    }
    linked.erase(LaneType::other);
    types.push_back(linked.size() == 1 ? *linked.begin() : lane.type);
  }
  for (std::size_t i = 0; i < types.size(); ++i) map->lanes[i].type = types[i];
}

}  // namespace

void make_lanes(Conversion* conversion) {
  LoggedScene& scene = conversion->scene;
  RoadMap& map = conversion->out->map;
  LaneWidthEstimator ruler(conversion);
  std::vector<std::optional<std::vector<double>>> widths;
  for (const LoggedLane& lane : scene.lanes) widths.push_back(ruler.measure(lane));
  complete_widths(conversion, &widths);
  for (std::size_t i = 0; i < scene.lanes.size(); ++i) {
    const LoggedLane& logged = scene.lanes[i];
    const std::vector<CurvePoint> points = resampled(conversion, logged.points, *widths[i], place_of(logged));
    if (points.empty()) {
      scene.note("lanes of fewer than two points left out", place_of(logged));
      continue;
    }
    const int32_t index = static_cast<int32_t>(map.lanes.size());
    PICTURA_CHECK(conversion->lane_of_id.emplace(logged.id, index).second, "{}: lane {}: expected a unique id",
                  scene.source, logged.id);
    Lane lane;
    lane.type = logged.map_type.value_or(type_of(logged.type));
    lane.in_junction = logged.interpolating;
    lane.speed_limit_mps =
        logged.speed_limit_mps > 0 ? static_cast<float>(logged.speed_limit_mps) : kDefaultSpeedLimit_mps;
    lane.source_road = index;
    append_lane_points(points, &map, &lane);
    map.road_names.push_back(std::to_string(logged.id));
    map.lanes.push_back(lane);
    conversion->logged_lane.push_back(i);
  }
  PICTURA_CHECK(!map.lanes.empty(), "{}: {}: expected a lane of two points, got none", scene.source,
                scene.names.features);
}

void link_lanes(Conversion* conversion) {
  RoadMap& map = conversion->out->map;
  set_lane_links(conversion->scene.has_links ? given_links(conversion) : meeting_links(conversion), &map);
  if (!conversion->scene.is_authored) infer_types(&map);
  set_neighbors(conversion);
}

void find_junctions(Conversion* conversion) {
  find_crossing_junctions(
      [](const Lane& lane) { return lane.type == LaneType::driving || lane.type == LaneType::other; }, 0,
      [conversion](std::size_t amount) { conversion->count_work(amount); }, &conversion->out->map);
}

}  // namespace pictura::conversion
