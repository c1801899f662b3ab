#include "pictura/map/polyline_lanes.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>

namespace pictura {

namespace {

constexpr float kSegmentCell_m = 10.0f;
constexpr float kSharedEnd_m = 0.05f;

}  // namespace

void append_lane_points(const std::vector<CurvePoint>& points, RoadMap* map, Lane* lane_out) {
  lane_out->points.begin = static_cast<int32_t>(map->lane_points.size());
  const auto heading_of = [&](std::size_t i) {
    const Eigen::Vector2d chord =
        (points[std::min(i + 1, points.size() - 1)].position_m - points[i + 1 < points.size() ? i : i - 1].position_m)
            .head<2>();
    return std::atan2(chord.y(), chord.x());
  };
  double s_m = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (i > 0) s_m += plan_distance_m(points[i - 1].position_m, points[i].position_m);
    double heading = heading_of(i);
    if (i > 0 && i + 1 < points.size()) {
      // The mean of the directions of the chords that meet here.
      heading = heading_of(i - 1) + 0.5 * std::remainder(heading - heading_of(i - 1), 2 * std::numbers::pi);
    }
    map->lane_points.push_back({to_vec3(points[i].position_m),
                                static_cast<float>(std::remainder(heading, 2 * std::numbers::pi)),
                                static_cast<float>(points[i].width), static_cast<float>(s_m)});
  }
  lane_out->points.end = static_cast<int32_t>(map->lane_points.size());
  lane_out->length_m = static_cast<float>(s_m);
}

void set_lane_links(const LaneLinks& links, RoadMap* map) {
  std::vector<std::vector<int32_t>> after(map->lanes.size()), before(map->lanes.size());
  for (const auto& [from, to] : links) {
    after[from].push_back(to);
    before[to].push_back(from);
  }
  const auto append = [&](const std::vector<int32_t>& lanes) {
    IndexRange range{static_cast<int32_t>(map->lane_links.size()), 0};
    map->lane_links.insert(map->lane_links.end(), lanes.begin(), lanes.end());
    range.end = static_cast<int32_t>(map->lane_links.size());
    return range;
  };
  for (std::size_t i = 0; i < map->lanes.size(); ++i) {
    map->lanes[i].successors = append(after[i]);
    map->lanes[i].predecessors = append(before[i]);
  }
}

LanePieces segments_of(const RoadMap& map, LanePredicate is_wanted) {
  LanePieces result;
  std::vector<Aabb2> boxes;
  for (std::size_t lane = 0; lane < map.lanes.size(); ++lane) {
    if (!is_wanted(map.lanes[lane])) continue;
    const Span<const LanePoint> points = map.points_of(map.lanes[lane]);
    for (std::size_t i = 1; i < points.size(); ++i) {
      const Vec3 a = points[i - 1].position_m, b = points[i].position_m;
      result.segments.push_back({a, b, static_cast<int32_t>(lane)});
      boxes.push_back({{min_of(a.x, b.x), min_of(a.y, b.y)}, {max_of(a.x, b.x), max_of(a.y, b.y)}});
    }
  }
  result.grid = Grid(boxes, kSegmentCell_m);
  return result;
}

std::optional<Vec2> crossing(Vec3 a, Vec3 b, Vec3 c, Vec3 d) {
  const Eigen::Vector2d u(b.x - a.x, b.y - a.y), v(d.x - c.x, d.y - c.y), w(c.x - a.x, c.y - a.y);
  const double det = u.x() * v.y() - u.y() * v.x();
  if (std::abs(det) <= 1e-9 * u.norm() * v.norm()) return std::nullopt;
  const double s = (w.x() * v.y() - w.y() * v.x()) / det, t = (w.x() * u.y() - w.y() * u.x()) / det;
  if (s < 0 || s > 1 || t < 0 || t > 1) return std::nullopt;
  if (std::abs((a.z + s * (b.z - a.z)) - (c.z + t * (d.z - c.z))) >= double{kSameRoadLevel_m}) return std::nullopt;
  return Vec2{static_cast<float>(a.x + s * u.x()), static_cast<float>(a.y + s * u.y())};
}

void find_crossing_junctions(LanePredicate is_wanted, float bridged_m,
                             const std::function<void(std::size_t)>& count_work, RoadMap* map_inout) {
  RoadMap& map = *map_inout;
  const LanePieces driven = segments_of(map, is_wanted);
  // Lanes that fork, merge or continue each other share an end.
  const auto is_end = [&](int32_t lane, Vec2 p) {
    return length(start_of(map, lane).position_m.xy() - p) < kSharedEnd_m ||
           length(end_of(map, lane).position_m.xy() - p) < kSharedEnd_m;
  };
  std::vector<std::pair<int32_t, int32_t>> crossings;
  for (const LanePiece& segment : driven.segments) {
    const Aabb2 box{{min_of(segment.a_m.x, segment.b_m.x), min_of(segment.a_m.y, segment.b_m.y)},
                    {max_of(segment.a_m.x, segment.b_m.x), max_of(segment.a_m.y, segment.b_m.y)}};
    visit_items(driven.grid.view(), box, [&](std::size_t item) {
      count_work(4);
      const LanePiece& other = driven.segments[item];
      if (other.lane <= segment.lane) return;
      if (map.lanes[other.lane].source_road == map.lanes[segment.lane].source_road) return;  // opposite lanes of a road
      const std::optional<Vec2> place = crossing(segment.a_m, segment.b_m, other.a_m, other.b_m);
      if (place && !is_end(segment.lane, *place) && !is_end(other.lane, *place)) {
        crossings.emplace_back(segment.lane, other.lane);
      }
    });
  }
  for (const auto& [a, b] : crossings) {
    for (const int32_t lane : {a, b}) map.lanes[lane].in_junction = true;
  }
  const auto touches_junction = [&](IndexRange range) {
    const Span<const int32_t> lanes = map.links(range);
    return std::any_of(lanes.begin(), lanes.end(), [&](int32_t lane) { return map.lanes[lane].in_junction; });
  };
  std::vector<int32_t> bridges;
  for (std::size_t i = 0; i < map.lanes.size(); ++i) {
    const Lane& lane = map.lanes[i];
    if (lane.in_junction || !is_wanted(lane) || lane.length_m > bridged_m) continue;
    if (touches_junction(lane.predecessors) && touches_junction(lane.successors)) {
      bridges.push_back(static_cast<int32_t>(i));
    }
  }
  for (const int32_t lane : bridges) map.lanes[lane].in_junction = true;
  // Lanes that cross belong to one junction.
  std::vector<int32_t> group(map.lanes.size());
  std::iota(group.begin(), group.end(), 0);
  const auto first_of = [&](int32_t lane) {
    while (group[lane] != lane) {
      int32_t& parent = group[lane];
      parent = group[parent];
      lane = parent;
    }
    return lane;
  };
  const auto join = [&](int32_t a, int32_t b) {
    a = first_of(a);
    b = first_of(b);
    group[std::max(a, b)] = std::min(a, b);
  };
  for (const auto& [a, b] : crossings) join(a, b);
  // Lanes that fork or merge belong to one junction.
  for (const Lane& lane : map.lanes) {
    for (const IndexRange range : {lane.successors, lane.predecessors}) {
      int32_t before = -1;
      for (const int32_t other : map.links(range)) {
        if (!map.lanes[other].in_junction) continue;
        if (before >= 0) join(before, other);
        before = other;
      }
    }
  }
  for (std::size_t i = 0; i < map.lanes.size() && bridged_m > 0; ++i) {
    for (const int32_t next : map.links(map.lanes[i].successors)) {
      if (map.lanes[i].in_junction && map.lanes[next].in_junction) join(static_cast<int32_t>(i), next);
    }
  }
  std::map<int32_t, int32_t> junctions;
  for (std::size_t i = 0; i < map.lanes.size(); ++i) {
    Lane& lane = map.lanes[i];
    if (!lane.in_junction) continue;
    const int32_t first = first_of(static_cast<int32_t>(i));
    const auto [junction, is_new] = junctions.emplace(first, static_cast<int32_t>(map.junctions.size()));
    if (is_new) map.junctions.push_back({.name = map.road_names[map.lanes[first].source_road]});
    lane.junction = junction->second;
  }
}

}  // namespace pictura
