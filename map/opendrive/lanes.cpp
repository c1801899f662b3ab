// Builds lanes from sections: centre lines in the direction of travel, and neighbours.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "pictura/common/hypot.h"
#include "pictura/map/opendrive/build.h"

namespace pictura::opendrive {

namespace {

// Maximum distance from the origin. Up to this distance, float coordinates have a resolution of 8 mm.
constexpr double kMaxMapRadius_m = 1e5;

Lane make_lane(Build* build, const FileRoad& road, const FileSection& section, const FileLane& lane) {
  const bool forward = travels_forward(road, lane);
  std::vector<CurvePoint> points =
      sample_curve(breaks_of(road, section, lane.id, section.s, section.end), build->options.chord_error_m, kMaxPiece_m,
                   &build->budget, [&](double s) {
                     return CurvePoint{s, point_on_lane(road, section, lane, s, 0.5, &build->stations),
                                       lane_width(road, section, lane, s)};
                   });
  if (!forward) std::reverse(points.begin(), points.end());

  Lane result;
  result.type = lane.type;
  result.points.begin = static_cast<int32_t>(build->map->lane_points.size());
  double length_m = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const CurvePoint& point = points[i];
    if (i > 0) length_m += plan_distance_m(points[i - 1].position_m, point.position_m);
    const double heading = std::remainder(
        heading_between(road, section, inner_border(lane.id), lane.id, point.s) + (forward ? 0.0 : std::numbers::pi),
        2 * std::numbers::pi);
    build->map->lane_points.push_back({build->to_map(point.position_m), static_cast<float>(heading),
                                       static_cast<float>(point.width), static_cast<float>(length_m)});
  }
  result.points.end = static_cast<int32_t>(build->map->lane_points.size());
  result.length_m = static_cast<float>(length_m);
  return result;
}

/// Sets the neighbours of route lanes: adjacent lanes with the same direction of travel.
void join_neighbors(Build* build, const FileRoad& road, const FileSection& section, const SectionLanes& indices) {
  std::vector<Lane>& lanes = build->map->lanes;
  auto join = [&](const FileLane& left, const FileLane& right) {
    const int32_t left_index = indices.of(left.id), right_index = indices.of(right.id);
    if (left_index < 0 || right_index < 0) return;
    if (!is_route(left.type) || !is_route(right.type)) return;
    const bool forward = travels_forward(road, left);
    if (forward != travels_forward(road, right)) return;
    Lane &left_lane = lanes[left_index], &right_lane = lanes[right_index];
    (forward ? left_lane.right_neighbor : left_lane.left_neighbor) = right_index;
    (forward ? right_lane.left_neighbor : right_lane.right_neighbor) = left_index;
  };
  for (std::size_t i = 1; i < section.left.size(); ++i) join(section.left[i], section.left[i - 1]);
  for (std::size_t i = 1; i < section.right.size(); ++i) join(section.right[i - 1], section.right[i]);
  if (!section.left.empty() && !section.right.empty()) join(section.left[0], section.right[0]);
}

}  // namespace

void choose_origin(Build* build) {
  double low[2] = {1e300, 1e300}, high[2] = {-1e300, -1e300};
  const auto start_of = [](const FileRoad& road, const GeometryPiece& piece) {
    return deformed_point(road, piece.s, {piece.x, piece.y});
  };
  for (const FileRoad& road : build->network.roads) {
    for (const GeometryPiece& piece : road.geometry) {
      const Eigen::Vector2d xy = start_of(road, piece);
      for (int axis = 0; axis < 2; ++axis) {
        low[axis] = std::min(low[axis], xy[axis]);
        high[axis] = std::max(high[axis], xy[axis]);
      }
    }
  }
  for (int axis = 0; axis < 2; ++axis) build->map->origin_m[axis] = std::round(0.5 * (low[axis] + high[axis]));
  for (const FileRoad& road : build->network.roads) {
    for (const GeometryPiece& piece : road.geometry) {
      const Eigen::Vector2d xy = start_of(road, piece);
      const double radius_m = hypot_of(xy.x() - build->map->origin_m[0], xy.y() - build->map->origin_m[1]);
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
    const int32_t junction = road.junction.empty() ? -1 : build->network.junction_index.at(road.junction);
    std::vector<SectionLanes>& sections = build->lanes.emplace_back();
    for (const FileSection& section : road.sections) {
      SectionLanes& indices = sections.emplace_back();
      auto add_side = [&](const std::vector<FileLane>& side, std::vector<int32_t>* indices_out) {
        for (const FileLane& lane : side) {
          indices_out->push_back(lane.is_void ? -1 : static_cast<int32_t>(map.lanes.size()));
          if (lane.is_void) continue;
          Lane made = make_lane(build, road, section, lane);
          made.in_junction = junction >= 0;
          made.junction = junction;
          made.source_road = static_cast<int32_t>(r);
          made.source_section = lane.section;
          made.source_lane = lane.id;
          map.lanes.push_back(made);
          map.provenance.lanes.push_back(source_of(r, lane.where));
          build->file_lanes.push_back({&section, &lane});
        }
      };
      add_side(section.left, &indices.left);
      add_side(section.right, &indices.right);
      join_neighbors(build, road, section, indices);
    }
  }
}

}  // namespace pictura::opendrive
