// Makes the drawn parts of a scenario's map: road edges, marks, crosswalks and signs. Then counts the map's facts.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "pictura/common/error.h"
#include "pictura/common/scene.h"
#include "pictura/map/scenario/conversion.h"
#include "pictura/map/stripes.h"

namespace pictura::conversion {

namespace {

constexpr float kMarkWidth_m = 0.15f;
constexpr double kStripeOffset_m = 0.15;  // distance of the two stripes of a double line from its middle
/// Minimum length of a gap. Edges have dense points, so a longer piece is a gap in the recording. The edge is
/// interrupted there only if the piece crosses a lane.
constexpr double kJump_m = 2.0;
constexpr float kNearLane_m = 6.0f;
constexpr int kMinVotes = 20;
constexpr float kNearSign_m = 10.0f;
constexpr double kCell_m = 10.0;  // cell size of segments_of()'s grid

bool is_driven(const Lane& lane) { return lane.type == LaneType::driving; }
bool is_any(const Lane&) { return true; }

Aabb2 box_around(Vec3 p, float reach_m) { return {{p.x - reach_m, p.y - reach_m}, {p.x + reach_m, p.y + reach_m}}; }

struct NearLane {
  float distance_m = std::numeric_limits<float>::infinity();
  Vec2 to_point, direction;
};

/// Returns the nearest lane segment within `reach_m` of p, on the level of p.
NearLane nearest_lane(Conversion* conversion, const LanePieces& lanes, Vec3 p, float reach_m) {
  NearLane best;
  visit_items(lanes.grid.view(), box_around(p, reach_m), [&](std::size_t item) {
    conversion->count_work(4);
    const LanePiece& segment = lanes.segments[item];
    const Vec2 a = segment.a_m.xy(), way = segment.b_m.xy() - a;
    const float t = clamp(dot(p.xy() - a, way) / max_of(dot(way, way), 1e-12f), 0.0f, 1.0f);
    const float z = segment.a_m.z + t * (segment.b_m.z - segment.a_m.z);
    const Vec2 away = p.xy() - (a + way * t);
    if (std::abs(z - p.z) > kSameRoadLevel_m || length(away) > reach_m || length(away) >= best.distance_m) return;
    best = {length(away), away, way};
  });
  return best;
}

/// Whether most edges near lanes have the lane on their right. By convention, the road is on the left of edges.
bool are_reversed(Conversion* conversion, const LanePieces& lanes, const std::vector<std::vector<CurvePoint>>& lines) {
  int left = 0, right = 0;
  for (const std::vector<CurvePoint>& line : lines) {
    for (std::size_t i = 1; i < line.size(); ++i) {
      const Vec3 a = to_vec3(line[i - 1].position_m), b = to_vec3(line[i].position_m);
      const NearLane lane = nearest_lane(conversion, lanes, (a + b) * 0.5f, kNearLane_m);
      if (lane.distance_m > kNearLane_m) continue;
      const Vec2 way = b.xy() - a.xy();
      const float side = way.x * -lane.to_point.y - way.y * -lane.to_point.x;
      (side > 0 ? left : right)++;
    }
  }
  return left + right >= kMinVotes && right > left;
}

bool crosses_a_lane(Conversion* conversion, const LanePieces& lanes, Vec3 a, Vec3 b) {
  const Aabb2 box{{min_of(a.x, b.x), min_of(a.y, b.y)}, {max_of(a.x, b.x), max_of(a.y, b.y)}};
  // A long piece passes through many cells, which count as work.
  const double cells = ((box.high.x - box.low.x) / kCell_m + 1) * ((box.high.y - box.low.y) / kCell_m + 1);
  conversion->count_work(static_cast<std::size_t>(cells));
  bool crosses = false;
  visit_items(lanes.grid.view(), box, [&](std::size_t item) {
    conversion->count_work(4);
    const LanePiece& segment = lanes.segments[item];
    crosses = crosses || crossing(a, b, segment.a_m, segment.b_m).has_value();
  });
  return crosses;
}

void append_marking(Conversion* conversion, std::vector<CurvePoint> points, MarkColor color, bool broken) {
  RoadMap* map = &conversion->out->map;
  if (conversion->scene.is_authored) {
    // Points are rounded so that scene_of_scenario() can return the stripe or dash as a line.
    for (CurvePoint& point : points) point.position_m = conversion->rounded(point.position_m);
    points = cut_into_pieces(conversion, points, "a stripe or dash");
  }
  if (points.size() < 2) return;
  Marking marking{.width_m = kMarkWidth_m, .color = color, .broken = broken};
  marking.points.begin = static_cast<int32_t>(map->marking_points.size());
  for (const CurvePoint& point : points) map->marking_points.push_back(to_vec3(point.position_m));
  marking.points.end = static_cast<int32_t>(map->marking_points.size());
  map->markings.push_back(marking);
}

void append_dashes(Conversion* conversion, const std::vector<CurvePoint>& line, MarkColor color) {
  const std::vector<std::vector<CurvePoint>> dashes = dashes_of(line);
  conversion->count_work(dashes.size() * line.size());
  for (const std::vector<CurvePoint>& dash : dashes) append_marking(conversion, dash, color, true);
}

}  // namespace

void make_edges(Conversion* conversion) {
  LoggedScene& scene = conversion->scene;
  RoadMap& map = conversion->out->map;
  const LanePieces lanes = segments_of(map, is_driven);
  // Parts of edges. Gaps that cross a lane separate them.
  std::vector<std::vector<CurvePoint>> lines;
  for (const LoggedEdge& edge : scene.edges) {
    const std::string place = fmt::format("edge {}", edge.id);
    LoggedPoints part;
    const auto finish = [&] {
      std::vector<CurvePoint> line = resampled(conversion, part, {}, place);
      if (line.empty()) {
        scene.note("edges of fewer than two points left out", place);
      } else {
        lines.push_back(std::move(line));
      }
      part.clear();
    };
    for (const Eigen::Vector3d& p : edge.points) {
      if (!part.empty() && !scene.is_authored && plan_distance_m(part.back(), p) > kJump_m) {
        const Vec3 a = to_vec3(conversion->from_origin(part.back())), b = to_vec3(conversion->from_origin(p));
        const bool is_near = std::abs(b.x) <= kMaxScenarioRadius_m && std::abs(b.y) <= kMaxScenarioRadius_m;
        if (is_near && crosses_a_lane(conversion, lanes, a, b)) {
          scene.note("gaps of edges across lanes left open", place);
          finish();
        }
      }
      part.push_back(p);
    }
    finish();
  }
  // Edges of a RoadMap have the road on their right.
  bool is_reversed = are_reversed(conversion, lanes, lines);
  if (is_reversed && scene.is_authored) {
    scene.note("edges with lanes on their right, though the road is stated to be on their left", "the first edge");
    is_reversed = false;
  } else if (is_reversed) {
    scene.note("edges with the road on their right, for the whole file", "the first edge");
  }
  for (std::vector<CurvePoint>& line : lines) {
    if (!is_reversed) std::reverse(line.begin(), line.end());
    for (std::size_t i = 1; i < line.size(); ++i) {
      map.road_edges.push_back({to_vec3(line[i - 1].position_m), to_vec3(line[i].position_m)});
    }
  }
}

void make_markings(Conversion* conversion) {
  LoggedScene& scene = conversion->scene;
  for (const LoggedLine& logged : scene.lines) {
    const std::string place = fmt::format("road line {}", logged.id);
    const std::vector<CurvePoint> line = resampled(conversion, logged.points, {}, place);
    if (line.empty()) {
      scene.note("road lines of fewer than two points left out", place);
      continue;
    }
    const auto left = [&] { return moved_left(line, kStripeOffset_m); };
    const auto right = [&] { return moved_left(line, -kStripeOffset_m); };
    const auto solid = [&](const std::vector<CurvePoint>& points, MarkColor color) {
      append_marking(conversion, points, color, false);
    };
    switch (logged.type) {
      case LoggedLineType::unknown:
      case LoggedLineType::solid_single_white: solid(line, MarkColor::white); break;
      case LoggedLineType::solid_single_yellow: solid(line, MarkColor::yellow); break;
      case LoggedLineType::broken_single_white: append_dashes(conversion, line, MarkColor::white); break;
      case LoggedLineType::broken_single_yellow: append_dashes(conversion, line, MarkColor::yellow); break;
      case LoggedLineType::dash_white: append_marking(conversion, line, MarkColor::white, true); break;
      case LoggedLineType::dash_yellow: append_marking(conversion, line, MarkColor::yellow, true); break;
      case LoggedLineType::solid_double_white:
        solid(left(), MarkColor::white);
        solid(right(), MarkColor::white);
        break;
      case LoggedLineType::solid_double_yellow:
        solid(left(), MarkColor::yellow);
        solid(right(), MarkColor::yellow);
        break;
      case LoggedLineType::broken_double_yellow:
        append_dashes(conversion, left(), MarkColor::yellow);
        append_dashes(conversion, right(), MarkColor::yellow);
        break;
      case LoggedLineType::passing_double_yellow:
        // Passing is allowed on one side only, but the format does not contain the side.
        solid(left(), MarkColor::yellow);
        append_dashes(conversion, right(), MarkColor::yellow);
        break;
    }
  }
}

void make_signs(Conversion* conversion) {
  LoggedScene& scene = conversion->scene;
  RoadMap& map = conversion->out->map;
  for (const LoggedPolygon& polygon : scene.crosswalks) {
    const std::string place = fmt::format("crosswalk {}", polygon.id);
    std::vector<CurvePoint> ring = resampled(conversion, polygon.points, {}, place);
    if (ring.size() > 1 && plan_distance_m(ring.front().position_m, ring.back().position_m) < kSamePoint_m) {
      ring.pop_back();
    }
    if (ring.size() < 3) {
      scene.note("crosswalks of fewer than three points left out", place);
      continue;
    }
    Crosswalk crosswalk;
    crosswalk.outline.begin = static_cast<int32_t>(map.outline_points.size());
    for (const CurvePoint& point : ring) map.outline_points.push_back(to_vec3(point.position_m));
    crosswalk.outline.end = static_cast<int32_t>(map.outline_points.size());
    map.crosswalks.push_back(crosswalk);
  }
  const LanePieces lanes = segments_of(map, is_any);
  for (const LoggedStopSign& logged : scene.stop_signs) {
    // 206 is a stop sign in OpenDRIVE's catalogue.
    Sign sign{.name = std::to_string(logged.id), .type = "206", .subtype = "-1", .country = "OpenDRIVE"};
    sign.position_m = to_vec3(conversion->from_origin(logged.position_m));
    sign.lanes.begin = static_cast<int32_t>(map.sign_lanes.size());
    for (const int64_t id : logged.lanes) {
      if (const auto lane = conversion->lane_of_id.find(id); lane != conversion->lane_of_id.end()) {
        map.sign_lanes.push_back(lane->second);
      } else {
        scene.note("lanes of stop signs that the map does not have", fmt::format("stop sign {}", logged.id));
      }
    }
    sign.lanes.end = static_cast<int32_t>(map.sign_lanes.size());
    const bool is_near =
        std::abs(sign.position_m.x) <= kMaxScenarioRadius_m && std::abs(sign.position_m.y) <= kMaxScenarioRadius_m;
    PICTURA_CHECK(is_near, "{}: stop sign {}: expected coordinates within {} m of the map's centre", scene.source,
                  logged.id, kMaxScenarioRadius_m);
    const NearLane near = nearest_lane(conversion, lanes, sign.position_m, kNearSign_m);
    if (near.distance_m <= kNearSign_m) sign.heading_rad = std::atan2(near.direction.y, near.direction.x);
    map.signs.push_back(sign);
  }
}

void count_facts(RoadMap* map) {
  MapFacts& facts = map->facts;
  facts.junctions = static_cast<int32_t>(map->junctions.size());
  facts.lanes = static_cast<int32_t>(map->lanes.size());
  facts.crosswalks = static_cast<int32_t>(map->crosswalks.size());
  facts.signs = static_cast<int32_t>(map->signs.size());
  for (const Lane& lane : map->lanes) {
    if (lane.type != LaneType::driving) continue;
    ++facts.driving_lanes;
    facts.driving_lane_km += 1e-3 * static_cast<double>(lane.length_m);
    if (lane.in_junction) facts.driving_lane_km_in_junctions += 1e-3 * static_cast<double>(lane.length_m);
  }
  facts.z_min_m = std::numeric_limits<double>::infinity();
  facts.z_max_m = -facts.z_min_m;
  for (const LanePoint& point : map->lane_points) {
    facts.z_min_m = std::min(facts.z_min_m, static_cast<double>(point.position_m.z) + map->origin_m[2]);
    facts.z_max_m = std::max(facts.z_max_m, static_cast<double>(point.position_m.z) + map->origin_m[2]);
  }
}

}  // namespace pictura::conversion
