#include "pictura/replay/map_shapes.h"

#include <cmath>

#include "pictura/drawing/lane_shapes.h"
#include "pictura/replay/images.h"
#include "pictura/replay/units.h"

namespace pictura {

namespace {

ReplayPoint point_of(const Vec3& p) { return {centimetres(p.x), centimetres(p.y), centimetres(p.z)}; }
std::array<int32_t, 2> point_of(Vec2 p) { return {centimetres(p.x), centimetres(p.y)}; }

ReplayShape line(ShapeKind kind, const Vec3& a, const Vec3& b, float width_m = 0) {
  return {kind, 0, centimetres(width_m), {point_of(a.xy()), point_of(b.xy())}};
}

ReplayShape rectangle(const ParkingSpace& space) {
  const Vec2 ahead = Vec2{std::cos(space.heading_rad), std::sin(space.heading_rad)} * (0.5f * space.length_m);
  const Vec2 side = left_normal(ahead) * (space.width_m / space.length_m), at = space.center_m.xy();
  ReplayShape shape{ShapeKind::parking_space, 0, 0, {}};
  for (const Vec2 corner : {at + ahead + side, at - ahead + side, at - ahead - side, at + ahead - side}) {
    shape.points_cm.push_back(point_of(corner));
  }
  return shape;
}

/// Appends pieces as lines. A piece that continues the previous piece extends the previous piece's line.
template <typename Pieces>
void append_lines(ShapeKind kind, const Pieces& pieces, std::vector<ReplayShape>* shapes_out) {
  const size_t first = shapes_out->size();
  for (const auto& piece : pieces) {
    ReplayShape next = line(kind, piece.a_m, piece.b_m);
    if (shapes_out->size() > first && shapes_out->back().points_cm.back() == next.points_cm[0])
      shapes_out->back().points_cm.push_back(next.points_cm[1]);
    else
      shapes_out->push_back(std::move(next));
  }
}

}  // namespace

std::vector<ReplayShape> map_shapes(const CompiledMap& map) {
  const RoadMap& road = *map.road;
  std::vector<ReplayShape> shapes;
  for (const int32_t index : lanes_in_drawing_order(road)) {
    const Lane& lane = road.lanes[index];
    ReplayShape shape{ShapeKind::lane, static_cast<int32_t>(lane.type), 0, {}};
    for (const Vec2 corner : outline_of(road, lane)) shape.points_cm.push_back(point_of(corner));
    shapes.push_back(std::move(shape));
  }
  for (const ParkingSpace& space : road.parking_spaces) {
    if (space.length_m > 0) shapes.push_back(rectangle(space));
  }
  for (const Crosswalk& crosswalk : road.crosswalks) {
    ReplayShape shape{ShapeKind::crosswalk, 0, 0, {}};
    for (int32_t i = crosswalk.outline.begin; i < crosswalk.outline.end; ++i) {
      shape.points_cm.push_back(point_of(road.outline_points[i].xy()));
    }
    shapes.push_back(std::move(shape));
  }
  for (const Marking& marking : road.markings) {
    ReplayShape shape{ShapeKind::marking, static_cast<int32_t>(marking.color), centimetres(marking.width_m), {}};
    for (int32_t i = marking.points.begin; i < marking.points.end; ++i) {
      shape.points_cm.push_back(point_of(road.marking_points[i].xy()));
    }
    shapes.push_back(std::move(shape));
  }
  for (const PaintedStopLine& stop : road.stop_lines) {
    shapes.push_back(line(ShapeKind::stop_line, stop.a_m, stop.b_m, stop.width_m));
  }
  append_lines(ShapeKind::road_edge, road.road_edges, &shapes);
  append_lines(ShapeKind::wall, map.geometry.walls, &shapes);
  for (const LightHead& head : map.geometry.heads) {
    const TrafficLight& light = road.lights[head.signal];
    ReplayShape shape = line(ShapeKind::light, light.stop_a_m, light.stop_b_m);
    shape.points_cm.push_back(point_of(head.position_m.xy()));
    shape.points_cm.push_back(point_of(head.position_m.xy() + head.facing));
    shapes.push_back(std::move(shape));
  }
  return shapes;
}

ReplayScenery map_scenery(const StaticGeometry& geometry) {
  ReplayScenery scenery;
  Vec3 end;  // end of the last line
  for (const Strip& strip : geometry.strips) {
    ReplayLine next{strip.kind,
                    replay_hue(strip.color),
                    static_cast<int32_t>(std::lround(static_cast<double>(strip.width_m) * 1000)),
                    {point_of(strip.a_m), point_of(strip.b_m)}};
    const bool goes_on = !scenery.lines.empty() && end.x == strip.a_m.x && end.y == strip.a_m.y &&
                         end.z == strip.a_m.z && scenery.lines.back().kind == next.kind &&
                         scenery.lines.back().color == next.color && scenery.lines.back().width_mm == next.width_mm;
    if (goes_on)
      scenery.lines.back().points_cm.push_back(next.points_cm[1]);
    else
      scenery.lines.push_back(std::move(next));
    end = strip.b_m;
  }
  for (const WallFace& wall : geometry.walls) {
    scenery.walls.push_back(
        {replay_hue(wall.color), centimetres(wall.height_m), point_of(wall.a_m), point_of(wall.b_m)});
  }
  for (const LightHead& head : geometry.heads) {
    scenery.heads.push_back({head.signal, tenths_of_degree(std::atan2(head.facing.y, head.facing.x)),
                             tenths_of_degree(std::acos(head.cos_half_angle)), point_of(head.position_m)});
  }
  return scenery;
}

}  // namespace pictura
