#include "pictura/map/map_geometry.h"

#include <cmath>

#include "pictura/common/rng.h"

namespace pictura {

namespace {

constexpr float kRoadEdgeWidth_m = 0.15f;

Rgb mark_color(MarkColor color) { return color == MarkColor::yellow ? kYellowMarkColor : kWhiteMarkColor; }

/// Consecutive edges that meet end to end, as one polyline each, so that their strips are mitred.
void append_road_edges(const RoadMap& map, std::vector<Strip>* strips_out) {
  std::vector<Vec3> points;
  auto flush = [&] {
    if (points.size() >= 2) append_strips(points, kRoadEdgeWidth_m, kRoadEdgeColor, StripKind::road_edge, strips_out);
    points.clear();
  };
  for (const RoadEdge& edge : map.road_edges) {
    if (points.empty() || length(points.back() - edge.a_m) > 0) {
      flush();
      points.push_back(edge.a_m);
    }
    points.push_back(edge.b_m);
  }
  flush();
}

}  // namespace

StaticGeometry make_static_geometry(const RoadMap& map, const MapGeometryOptions& options) {
  StaticGeometry geometry;
  for (const Marking& marking : map.markings) {
    append_strips({map.marking_points.data() + marking.points.begin, static_cast<std::size_t>(marking.points.size())},
                  marking.width_m, mark_color(marking.color), StripKind::lane_mark, &geometry.strips);
  }
  append_road_edges(map, &geometry.strips);
  if (options.walls) geometry.walls = make_walls(map, options);
  geometry.num_signals = static_cast<int32_t>(map.lights.size());
  geometry.build_grids();
  return geometry;
}

std::vector<WallFace> make_walls(const RoadMap&, const MapGeometryOptions&) { return {}; }

}  // namespace pictura
