#include "pictura/map/map_geometry.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "pictura/common/rng.h"
#include "pictura/common/support/suggestion.h"
#include "pictura/map/painted_lines.h"

namespace pictura {

namespace {

constexpr float kRoadEdgeWidth_m = 0.15f;
constexpr float kCrosswalkWidth_m = 0.3f;  // line width of a crosswalk's outline
constexpr float kStopLineWidth_m = 0.4f;
constexpr float kSameStopLine_m = 8.0f;
// Buildings have 1 to 4 pieces (about 8 m each) and are mostly separated by gaps of 1 or 2 pieces.
constexpr int kMaxBuildingPieces = 4, kMaxGapPieces = 2;
constexpr float kTerracedFraction = 0.3f;
constexpr float kMinWall_m = 3.0f, kMaxWall_m = 12.0f;

Rgb mark_color(MarkColor color) {
  switch (color) {
    case MarkColor::white: return kWhiteMarkColor;
    case MarkColor::yellow: return kYellowMarkColor;
    case MarkColor::red: return rgb8(200, 60, 60);
    case MarkColor::green: return rgb8(60, 180, 90);
    case MarkColor::blue: return rgb8(70, 110, 220);
    case MarkColor::orange: return rgb8(240, 140, 40);
    case MarkColor::violet: return rgb8(150, 80, 200);
    case MarkColor::black: return {};
  }
  return kWhiteMarkColor;
}

/// Whether a painted line is the stop line of a light. It may be some metres inside the junction.
bool has_light(const RoadMap& map, const PaintedStopLine& line) {
  const Vec3 middle = (line.a_m + line.b_m) * 0.5f;
  return std::any_of(map.lights.begin(), map.lights.end(), [&](const TrafficLight& light) {
    return length((light.stop_a_m + light.stop_b_m) * 0.5f - middle) < kSameStopLine_m;
  });
}

/// Appends the strips of road edges. Consecutive edges that meet end to end form one polyline, so that their strips are
/// mitred.
void append_road_edges(const std::vector<RoadEdge>& edges, std::vector<Strip>* strips_out) {
  std::vector<Vec3> points;
  auto flush = [&] {
    if (points.size() >= 2) append_strips(points, kRoadEdgeWidth_m, kRoadEdgeColor, StripKind::road_edge, strips_out);
    points.clear();
  };
  for (const RoadEdge& edge : edges) {
    if (points.empty() || length(points.back() - edge.a_m) > 0) {
      flush();
      points.push_back(edge.a_m);
    }
    points.push_back(edge.b_m);
  }
  flush();
}

/// Returns the height of the road near `at_m`: of the nearest point of the light's lanes, or of its stop line if that
/// is nearer.
float road_height_m(const RoadMap& map, const TrafficLight& light, Vec2 at_m) {
  Vec3 nearest = (light.stop_a_m + light.stop_b_m) * 0.5f;
  const auto apart_m = [at_m](Vec3 p) { return length(p.xy() - at_m); };
  for (int32_t i = light.lanes.begin; i < light.lanes.end; ++i) {
    const Lane& lane = map.lanes[map.light_lanes[i]];
    const Span<const LanePoint> points = map.points_of(lane);
    for (size_t k = 1; k < points.size(); ++k) {
      const Vec3 a = points[k - 1].position_m, piece = points[k].position_m - a;
      const float length2_m2 = dot(piece.xy(), piece.xy());
      const float fraction = length2_m2 > 0 ? std::clamp(dot(at_m - a.xy(), piece.xy()) / length2_m2, 0.0f, 1.0f) : 0;
      const Vec3 p = a + piece * fraction;
      if (apart_m(p) < apart_m(nearest)) nearest = p;
    }
  }
  return nearest.z;
}

Vec3 head_position(const RoadMap& map, const TrafficLight& light, LightHeads heads) {
  if (heads == LightHeads::as_mapped) return light.head_m;
  const SinCos direction = sincos_of(light.stop_heading_rad);
  const Vec2 forward{direction.cos, direction.sin}, middle = (light.stop_a_m.xy() + light.stop_b_m.xy()) * 0.5f;
  const float ahead_m = dot(light.head_m.xy() - middle, forward);
  if (ahead_m >= kVisibleHeadAhead_m) return light.head_m;
  const Vec2 at = light.head_m.xy() + forward * (kVisibleHeadAhead_m - ahead_m);
  return {at.x, at.y, road_height_m(map, light, at) + kVisibleHeadHeight_m};
}

/// Removes duplicate strips, because overlapping roads of a junction may repeat a crosswalk. painted_lines() has
/// already removed duplicate lane marks.
void remove_duplicates(std::vector<Strip>* strips_inout) {
  using Key = std::array<float, 15>;
  std::set<Key> keys;
  std::erase_if(*strips_inout, [&](const Strip& strip) {
    const Vec3 a = strip.a_m, b = strip.b_m;
    const Rgb color = strip.color;
    const Key key{a.x,
                  a.y,
                  a.z,
                  b.x,
                  b.y,
                  b.z,
                  strip.side_a.x,
                  strip.side_a.y,
                  strip.side_b.x,
                  strip.side_b.y,
                  strip.width_m,
                  color.r,
                  color.g,
                  color.b,
                  static_cast<float>(strip.kind)};
    return !keys.insert(key).second;
  });
}

}  // namespace

LightHeads light_heads_named(const std::string& name) {
  return static_cast<LightHeads>(index_of_word("light_heads", name, kLightHeadsNames));
}

std::string name_of(LightHeads heads) { return kLightHeadsNames[static_cast<size_t>(heads)]; }

StaticGeometry make_static_geometry(const RoadMap& map, const MapGeometryOptions& options) {
  StaticGeometry geometry;
  const std::vector<PaintedLine> lines = painted_lines(map);
  for (const PaintedLine& line : lines) {
    append_strips(line.points_m, line.width_m, mark_color(line.color), StripKind::lane_mark, &geometry.strips);
  }
  append_road_edges(uncovered_edges(map, lines, kRoadEdgeWidth_m), &geometry.strips);
  for (const Crosswalk& crosswalk : map.crosswalks) {
    std::vector<Vec3> ring(map.outline_points.begin() + crosswalk.outline.begin,
                           map.outline_points.begin() + crosswalk.outline.end);
    ring.push_back(ring.front());
    append_strips(ring, kCrosswalkWidth_m, kCrosswalkColor, StripKind::crosswalk, &geometry.strips);
  }
  for (const PaintedStopLine& line : map.stop_lines) {
    if (has_light(map, line)) continue;
    const std::array<Vec3, 2> ends{line.a_m, line.b_m};
    append_strips(ends, line.width_m, kStopLineColor, StripKind::stop_line, &geometry.strips);
  }
  for (std::size_t i = 0; i < map.lights.size(); ++i) {
    const TrafficLight& light = map.lights[i];
    const std::array<Vec3, 2> stop_line{light.stop_a_m, light.stop_b_m};
    append_strips(stop_line, kStopLineWidth_m, kStopLineColor, StripKind::stop_line, &geometry.strips);
    geometry.heads.push_back({head_position(map, light, options.light_heads), light.head_facing,
                              cos_of(options.light_half_angle_rad), static_cast<int32_t>(i)});
  }
  remove_duplicates(&geometry.strips);
  if (options.walls) geometry.walls = make_walls(map, options);
  geometry.num_signals = static_cast<int32_t>(map.lights.size());
  geometry.build_grids();
  return geometry;
}

std::vector<WallFace> make_walls(const RoadMap& map, const MapGeometryOptions& options) {
  std::vector<WallFace> walls;
  uint32_t num_draws = 0;
  int remaining_pieces = 0;
  bool is_building = false;
  float height_m = 0;
  for (const BuildingLine& line : map.building_lines) {
    if (remaining_pieces == 0) {
      // Draws the next building or gap, and its length in pieces of building line.
      RandomStream random({.seed = options.wall_seed, .episode = num_draws++, .purpose = Purpose::walls});
      is_building = !is_building || random.uniform() < kTerracedFraction;
      remaining_pieces = 1 + random.below(is_building ? kMaxBuildingPieces : kMaxGapPieces);
      height_m = random.uniform(kMinWall_m, kMaxWall_m);
    }
    --remaining_pieces;
    if (is_building) walls.push_back({line.a_m, line.b_m, height_m});
  }
  return walls;
}

}  // namespace pictura
