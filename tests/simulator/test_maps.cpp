#include "pictura/tests/simulator/test_maps.h"

#include <cmath>

namespace pictura::testing {
namespace {

constexpr float kLaneWidth_m = 4.0f;

/// Appends a lane along points and headings; returns its index.
int32_t add_lane(RoadMap* map, const std::vector<Vec3>& points, const std::vector<float>& headings) {
  Lane lane;
  lane.type = LaneType::driving;
  lane.is_endless = true;
  lane.speed_limit_mps = 10;
  lane.points.begin = static_cast<int32_t>(map->lane_points.size());
  float s = 0;
  for (size_t i = 0; i < points.size(); ++i) {
    if (i > 0) s += length(points[i] - points[i - 1]);
    map->lane_points.push_back({points[i], headings[i], kLaneWidth_m, s});
  }
  lane.points.end = static_cast<int32_t>(map->lane_points.size());
  lane.length_m = s;
  map->lanes.push_back(lane);
  return static_cast<int32_t>(map->lanes.size()) - 1;
}

void add_edges(RoadMap* map, const std::vector<Vec3>& points) {
  for (size_t i = 0; i + 1 < points.size(); ++i) map->road_edges.push_back({points[i], points[i + 1]});
}

void link(RoadMap* map, int32_t from, int32_t to) {
  const auto append = [map](IndexRange* range_out, int32_t lane) {
    range_out->begin = static_cast<int32_t>(map->lane_links.size());
    map->lane_links.push_back(lane);
    range_out->end = static_cast<int32_t>(map->lane_links.size());
  };
  append(&map->lanes[from].successors, to);
  append(&map->lanes[to].predecessors, from);
}

struct Arc {
  std::vector<Vec3> points;
  std::vector<float> headings;
};

Arc make_arc(Vec2 center, float radius_m, float begin_rad, float end_rad) {
  Arc arc;
  const int pieces = static_cast<int>(std::ceil(radius_m * (end_rad - begin_rad) / 2.0f));
  for (int i = 0; i <= pieces; ++i) {
    const float angle = begin_rad + (end_rad - begin_rad) * static_cast<float>(i) / static_cast<float>(pieces);
    arc.points.push_back({center.x + radius_m * std::cos(angle), center.y + radius_m * std::sin(angle), 0});
    arc.headings.push_back(wrap_angle(angle + kHalfPi));
  }
  return arc;
}

Arc make_straight(Vec2 from, Vec2 to) {
  Arc line;
  const int pieces = static_cast<int>(std::ceil(length(to - from) / 10.0f));
  for (int i = 0; i <= pieces; ++i) {
    const Vec2 at = from + (to - from) * (static_cast<float>(i) / static_cast<float>(pieces));
    line.points.push_back({at.x, at.y, 0});
    line.headings.push_back(std::atan2(to.y - from.y, to.x - from.x));
  }
  return line;
}

}  // namespace

SimulatorConfig cars(SimulatorConfig config) {
  config.pedestrian_fraction = config.cyclist_fraction = 0;
  config.parked_cars = 0;
  return config;
}

std::shared_ptr<RoadMap> ring_road(float radius_m) {
  auto map = std::make_shared<RoadMap>();
  map->name = "ring";
  for (int quarter = 0; quarter < 4; ++quarter) {
    const float begin = kHalfPi * static_cast<float>(quarter);
    const Arc middle = make_arc({}, radius_m, begin, begin + kHalfPi);
    add_lane(map.get(), middle.points, middle.headings);
    // The road is to the right of an edge, so the outer edge runs against the traffic.
    const Arc outer = make_arc({}, radius_m + 0.5f * kLaneWidth_m, begin, begin + kHalfPi);
    add_edges(map.get(), make_arc({}, radius_m - 0.5f * kLaneWidth_m, begin, begin + kHalfPi).points);
    add_edges(map.get(), {outer.points.rbegin(), outer.points.rend()});
  }
  for (int quarter = 0; quarter < 4; ++quarter) link(map.get(), quarter, (quarter + 1) % 4);
  return map;
}

std::shared_ptr<RoadMap> stadium(float straight_m, int num_lanes) {
  auto map = std::make_shared<RoadMap>();
  map->name = "stadium";
  constexpr float kHeight_m = 40.0f;
  const Vec2 east{straight_m, 0.5f * kHeight_m}, west{0, 0.5f * kHeight_m};
  const auto parts_at = [&](float inset_m) {
    const float radius = 0.5f * kHeight_m - inset_m;
    return std::vector<Arc>{make_straight({0, inset_m}, {straight_m, inset_m}),
                            make_arc(east, radius, -kHalfPi, kHalfPi),
                            make_straight({straight_m, kHeight_m - inset_m}, {0, kHeight_m - inset_m}),
                            make_arc(west, radius, kHalfPi, 3 * kHalfPi)};
  };
  for (int lane = 0; lane < num_lanes; ++lane) {
    for (const Arc& part : parts_at(kLaneWidth_m * static_cast<float>(lane)))
      add_lane(map.get(), part.points, part.headings);
  }
  for (int lane = 0; lane < num_lanes; ++lane) {
    for (int part = 0; part < 4; ++part) {
      const int32_t index = 4 * lane + part;
      link(map.get(), index, 4 * lane + (part + 1) % 4);
      if (lane > 0) map->lanes[index].right_neighbor = index - 4;
      if (lane + 1 < num_lanes) map->lanes[index].left_neighbor = index + 4;
    }
  }
  const std::vector<Arc> outer = parts_at(-0.5f * kLaneWidth_m);
  for (auto part = outer.rbegin(); part != outer.rend(); ++part) {
    add_edges(map.get(), {part->points.rbegin(), part->points.rend()});
  }
  for (const Arc& part : parts_at(kLaneWidth_m * (static_cast<float>(num_lanes) - 0.5f)))
    add_edges(map.get(), part.points);
  return map;
}

void add_light(RoadMap* map, float x_m, float width_m, int num_phases, std::vector<int32_t> held_lanes) {
  if (map->junctions.empty()) map->junctions.push_back({"j", num_phases});
  TrafficLight light;
  light.stop_a_m = {x_m, width_m - 0.5f * kLaneWidth_m, 0};
  light.stop_b_m = {x_m, -0.5f * kLaneWidth_m, 0};
  light.stop_heading_rad = 0;
  light.head_m = {x_m + 15, -3, 5};
  light.head_facing = {-1, 0};
  light.junction = 0;
  light.phase = 0;
  light.lanes.begin = static_cast<int32_t>(map->light_lanes.size());
  map->light_lanes.insert(map->light_lanes.end(), held_lanes.begin(), held_lanes.end());
  light.lanes.end = static_cast<int32_t>(map->light_lanes.size());
  map->lights.push_back(light);
}

int32_t add_side_lane(RoadMap* map, LaneType type, const std::vector<Vec3>& points) {
  std::vector<float> headings;
  for (size_t i = 0; i < points.size(); ++i) {
    const size_t from = i + 1 < points.size() ? i : i - 1;
    const Vec2 way = (points[from + 1] - points[from]).xy();
    headings.push_back(std::atan2(way.y, way.x));
  }
  const int32_t index = add_lane(map, points, headings);
  Lane& lane = map->lanes[index];
  lane.type = type;
  lane.is_endless = false;
  return index;
}

void add_crosswalk(RoadMap* map, const std::vector<Vec3>& corners) {
  Crosswalk crosswalk;
  crosswalk.outline.begin = static_cast<int32_t>(map->outline_points.size());
  map->outline_points.insert(map->outline_points.end(), corners.begin(), corners.end());
  crosswalk.outline.end = static_cast<int32_t>(map->outline_points.size());
  map->crosswalks.push_back(crosswalk);
}

}  // namespace pictura::testing
