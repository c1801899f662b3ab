#include "pictura/map/road_map.h"

#include <algorithm>
#include <cmath>

#include "pictura/common/error.h"
#include "pictura/common/scene.h"

namespace pictura {

namespace {

constexpr float kMaxCoordinate_m = 2e5f;
// Pieces of kMaxPiece_m may become longer when their ends are rounded to float.
constexpr float kPieceTolerance_m = 0.05f;

void check_index(const char* what, std::size_t item, const char* field, int32_t index, std::size_t count,
                 int32_t lowest) {
  PICTURA_CHECK(index >= lowest && index < static_cast<int32_t>(count),
                "{} {}: {}: expected an index in [{}, {}), got {}", what, item, field, lowest, count, index);
}

void check_range(const char* what, std::size_t item, const char* field, IndexRange range, std::size_t count,
                 int32_t fewest) {
  PICTURA_CHECK(range.begin >= 0 && range.begin <= range.end && range.end <= static_cast<int32_t>(count),
                "{} {}: {}: expected a range within [0, {}), got [{}, {})", what, item, field, count, range.begin,
                range.end);
  PICTURA_CHECK(range.size() >= fewest, "{} {}: {}: expected at least {}, got {}", what, item, field, fewest,
                range.size());
}

void check_point(const char* what, std::size_t item, Vec3 p) {
  for (const float value : {p.x, p.y, p.z}) {
    PICTURA_CHECK(std::isfinite(value) && std::abs(value) <= kMaxCoordinate_m,
                  "{} {}: expected finite coordinates within {} m, got ({}, {}, {})", what, item, kMaxCoordinate_m, p.x,
                  p.y, p.z);
  }
}

void check_number(const char* what, std::size_t item, const char* field, float value, float low, float high) {
  PICTURA_CHECK(value >= low && value <= high, "{} {}: {}: expected a number in [{}, {}], got {}", what, item, field,
                low, high, value);
}

/// Checks that links are mutual: if lane i lists another lane in `range`, the other lane must list lane i in `mirror`.
void check_mutual(const RoadMap& map, IndexRange Lane::* range, IndexRange Lane::* mirror, const char* field) {
  for (std::size_t i = 0; i < map.lanes.size(); ++i) {
    for (const int32_t other : map.links(map.lanes[i].*range)) {
      check_index("lane", i, field, other, map.lanes.size(), 0);
      const Span<const int32_t> back = map.links(map.lanes[other].*mirror);
      PICTURA_CHECK(std::find(back.begin(), back.end(), static_cast<int32_t>(i)) != back.end(),
                    "lane {}: {}: lane {} does not refer back to it", i, field, other);
    }
  }
}

/// Checks that every lane is in a row with a leftmost lane. Neighbours are mutual, so other lanes form rings.
void check_rows(const RoadMap& map) {
  std::vector<char> is_in_row(map.lanes.size(), 0);
  for (std::size_t i = 0; i < map.lanes.size(); ++i) {
    if (map.lanes[i].left_neighbor >= 0) continue;
    for (int32_t k = static_cast<int32_t>(i); k >= 0; k = map.lanes[k].right_neighbor) is_in_row[k] = 1;
  }
  for (std::size_t i = 0; i < map.lanes.size(); ++i) {
    PICTURA_CHECK(is_in_row[i], "lane {}: left_neighbor: expected a row of lanes that ends on the left, got a ring", i);
  }
}

void validate_lanes(const RoadMap& map) {
  for (std::size_t i = 0; i < map.lanes.size(); ++i) {
    const Lane& lane = map.lanes[i];
    check_range("lane", i, "points", lane.points, map.lane_points.size(), 2);
    check_range("lane", i, "successors", lane.successors, map.lane_links.size(), 0);
    check_range("lane", i, "predecessors", lane.predecessors, map.lane_links.size(), 0);
    check_index("lane", i, "left_neighbor", lane.left_neighbor, map.lanes.size(), -1);
    check_index("lane", i, "right_neighbor", lane.right_neighbor, map.lanes.size(), -1);
    check_index("lane", i, "junction", lane.junction, map.junctions.size(), -1);
    check_index("lane", i, "source_road", lane.source_road, map.road_names.size(), 0);
    check_number("lane", i, "speed_limit_mps", lane.speed_limit_mps, 0.1f, 1000.0f);
    check_number("lane", i, "length_m", lane.length_m, 1e-4f, 1e6f);
    if (lane.left_neighbor >= 0) {
      PICTURA_CHECK(map.lanes[lane.left_neighbor].right_neighbor == static_cast<int32_t>(i),
                    "lane {}: left_neighbor: lane {} does not refer back to it", i, lane.left_neighbor);
    }
    if (lane.right_neighbor >= 0) {
      PICTURA_CHECK(map.lanes[lane.right_neighbor].left_neighbor == static_cast<int32_t>(i),
                    "lane {}: right_neighbor: lane {} does not refer back to it", i, lane.right_neighbor);
    }
    const Span<const LanePoint> points = map.points_of(lane);
    for (std::size_t k = 0; k < points.size(); ++k) {
      check_point("lane", i, points[k].position_m);
      check_number("lane", i, "heading_rad", points[k].heading_rad, -kPi - 1e-4f, kPi + 1e-4f);
      check_number("lane", i, "width_m", points[k].width_m, 0.0f, 1e3f);
      if (k == 0) {
        check_number("lane", i, "s_m of its first point", points[k].s_m, 0.0f, 0.0f);
        continue;
      }
      PICTURA_CHECK(points[k].s_m > points[k - 1].s_m, "lane {}: s_m: expected more than {} at point {}, got {}", i,
                    points[k - 1].s_m, k, points[k].s_m);
      check_number("lane", i, "distance between two points",
                   length(points[k].position_m.xy() - points[k - 1].position_m.xy()), 0.0f,
                   kMaxPiece_m + kPieceTolerance_m);
    }
  }
  check_rows(map);
  check_mutual(map, &Lane::successors, &Lane::predecessors, "successors");
  check_mutual(map, &Lane::predecessors, &Lane::successors, "predecessors");
}

void validate_appearance(const RoadMap& map) {
  for (std::size_t i = 0; i < map.markings.size(); ++i) {
    check_range("marking", i, "points", map.markings[i].points, map.marking_points.size(), 2);
    check_number("marking", i, "width_m", map.markings[i].width_m, 1e-3f, 10.0f);
  }
  for (std::size_t i = 0; i < map.marking_points.size(); ++i) check_point("marking point", i, map.marking_points[i]);
  for (std::size_t i = 0; i < map.road_edges.size(); ++i) {
    const RoadEdge& edge = map.road_edges[i];
    check_point("road edge", i, edge.a_m);
    check_point("road edge", i, edge.b_m);
    check_number("road edge", i, "length", length(edge.b_m.xy() - edge.a_m.xy()), 1e-4f,
                 kMaxPiece_m + kPieceTolerance_m);
  }
  for (std::size_t i = 0; i < map.crosswalks.size(); ++i) {
    check_range("crosswalk", i, "outline", map.crosswalks[i].outline, map.outline_points.size(), 3);
  }
  for (std::size_t i = 0; i < map.outline_points.size(); ++i) check_point("outline point", i, map.outline_points[i]);
  for (std::size_t i = 0; i < map.parking_spaces.size(); ++i) {
    const ParkingSpace& space = map.parking_spaces[i];
    check_point("parking space", i, space.center_m);
    check_number("parking space", i, "heading_rad", space.heading_rad, -kPi - 1e-4f, kPi + 1e-4f);
    check_number("parking space", i, "length_m", space.length_m, 0.1f, 1e3f);
    check_number("parking space", i, "width_m", space.width_m, 0.1f, 1e3f);
  }
  for (std::size_t i = 0; i < map.building_lines.size(); ++i) {
    check_point("building line", i, map.building_lines[i].a_m);
    check_point("building line", i, map.building_lines[i].b_m);
  }
}

void validate_signs(const RoadMap& map) {
  for (std::size_t i = 0; i < map.stop_lines.size(); ++i) {
    const PaintedStopLine& line = map.stop_lines[i];
    check_point("painted stop line", i, line.a_m);
    check_point("painted stop line", i, line.b_m);
    check_number("painted stop line", i, "width_m", line.width_m, 1e-3f, 10.0f);
  }
  for (std::size_t i = 0; i < map.signs.size(); ++i) {
    const Sign& sign = map.signs[i];
    check_point("sign", i, sign.position_m);
    check_number("sign", i, "heading_rad", sign.heading_rad, -kPi - 1e-4f, kPi + 1e-4f);
    check_range("sign", i, "lanes", sign.lanes, map.sign_lanes.size(), 0);
  }
  for (std::size_t i = 0; i < map.sign_lanes.size(); ++i) {
    check_index("sign lane", i, "lane", map.sign_lanes[i], map.lanes.size(), 0);
  }
}

void validate_lights(const RoadMap& map) {
  for (std::size_t i = 0; i < map.lights.size(); ++i) {
    const TrafficLight& light = map.lights[i];
    for (const Vec3 p : {light.stop_a_m, light.stop_b_m, light.head_m}) check_point("light", i, p);
    check_number("light", i, "stop_heading_rad", light.stop_heading_rad, -kPi - 1e-4f, kPi + 1e-4f);
    check_number("light", i, "length of its facing", length(light.head_facing), 0.999f, 1.001f);
    check_number("light", i, "length of its stop line", length(light.stop_b_m.xy() - light.stop_a_m.xy()), 0.1f, 1e3f);
    check_index("light", i, "junction", light.junction, map.junctions.size(), -1);
    const int32_t phases = light.junction < 0 ? 1 : map.junctions[light.junction].num_phases;
    check_index("light", i, "phase", light.phase, static_cast<std::size_t>(phases), 0);
    check_range("light", i, "lanes", light.lanes, map.light_lanes.size(), 1);
  }
  for (std::size_t i = 0; i < map.light_lanes.size(); ++i) {
    check_index("light lane", i, "lane", map.light_lanes[i], map.lanes.size(), 0);
  }
}

/// Checks that every element has a source, or that none has. None has one in a map that was not read from text.
void validate_provenance(const RoadMap& map) {
  const auto check = [&](const char* what, const std::vector<SourceElement>& sources, std::size_t count) {
    PICTURA_CHECK(sources.empty() || sources.size() == count, "provenance: expected the sources of {} {}s, got {}",
                  count, what, sources.size());
    for (std::size_t i = 0; i < sources.size(); ++i) {
      check_index(what, i, "source road", sources[i].road, map.road_names.size(), -1);
      PICTURA_CHECK(sources[i].line >= 0, "{} {}: source line: expected 0 or more, got {}", what, i, sources[i].line);
    }
  };
  const Provenance& provenance = map.provenance;
  check("lane", provenance.lanes, map.lanes.size());
  check("marking", provenance.markings, map.markings.size());
  check("road edge", provenance.road_edges, map.road_edges.size());
  check("crosswalk", provenance.crosswalks, map.crosswalks.size());
  check("parking space", provenance.parking_spaces, map.parking_spaces.size());
  check("painted stop line", provenance.stop_lines, map.stop_lines.size());
  check("sign", provenance.signs, map.signs.size());
  check("light", provenance.lights, map.lights.size());
  check("junction", provenance.junctions, map.junctions.size());
  check("building line", provenance.building_lines, map.building_lines.size());
}

}  // namespace

const char* to_string(LaneType type) {
  switch (type) {
    case LaneType::driving: return "driving";
    case LaneType::bidirectional: return "bidirectional";
    case LaneType::parking: return "parking";
    case LaneType::ramp: return "ramp";
    case LaneType::shoulder: return "shoulder";
    case LaneType::sidewalk: return "sidewalk";
    case LaneType::biking: return "biking";
    case LaneType::median: return "median";
    case LaneType::border: return "border";
    case LaneType::stop: return "stop";
    case LaneType::restricted: return "restricted";
    case LaneType::other: return "other";
  }
  return "unknown";
}

const char* to_string(MarkColor color) {
  switch (color) {
    case MarkColor::white: return "white";
    case MarkColor::yellow: return "yellow";
    case MarkColor::red: return "red";
    case MarkColor::green: return "green";
    case MarkColor::blue: return "blue";
    case MarkColor::orange: return "orange";
    case MarkColor::violet: return "violet";
    case MarkColor::black: return "black";
  }
  return "unknown";
}

void validate(const RoadMap& map) {
  try {
    validate_lanes(map);
    validate_appearance(map);
    validate_signs(map);
    validate_lights(map);
    validate_provenance(map);
  } catch (const Error& error) {
    fail("map {}: {}", map.name, error.what());
  }
}

}  // namespace pictura
