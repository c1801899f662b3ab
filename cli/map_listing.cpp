#include "pictura/cli/map_listing.h"

#include <cmath>
#include <functional>
#include <string>

#include "pictura/cli/report.h"
#include "pictura/common/error.h"
#include "pictura/common/support/json_text.h"
#include "pictura/map/file_position.h"

namespace pictura {

namespace {

/// Rounds to millimetres, because floats are not much more precise and additional digits would be hard to read.
double rounded(double metres) { return std::round(metres * 1e3) / 1e3; }

class Listing {
 public:
  Listing(const Json& facts, const RoadMap& map) : map_(map), text_(json_text(facts, 2)) {
    text_.erase(text_.size() - 2);  // removes the final newline and bracket
    text_ += ",\n  \"elements\": {";
  }

  /// Appends an array of `count` elements. describe(i) returns element i; its index and source are added.
  void add(const char* kind, size_t count, const std::vector<SourceElement>& sources,
           const std::function<Json(size_t)>& describe) {
    text_ += fmt::format("{}\n    \"{}\": [", text_.back() == '{' ? "" : ",", kind);
    for (size_t i = 0; i < count; ++i) {
      Json element{{"index", i}};
      element.update(describe(i));
      if (i < sources.size()) add_source(sources[i], &element["source"]);
      text_ += (i ? ",\n      " : "\n      ") + json_text(element);
    }
    text_ += count ? "\n    ]" : "]";
  }

  Json place(Vec3 p) const {
    const std::array<double, 3> place_m = file_position_m(map_.origin_m, p);
    return {rounded(place_m[0]), rounded(place_m[1]), rounded(place_m[2])};
  }

  void print() {
    text_ += "\n  }\n}\n";
    print_result_text(text_);
  }

 private:
  void add_source(const SourceElement& source, Json* json) const {
    if (source.road >= 0) (*json)["road"] = map_.road_names[source.road];
    if (source.line > 0) (*json)["line"] = source.line;
  }

  const RoadMap& map_;
  std::string text_;
};

Json lanes_in(const std::vector<int32_t>& all, IndexRange range) {
  return std::vector<int32_t>(all.begin() + range.begin, all.begin() + range.end);
}

Json junction_name(const RoadMap& map, int32_t junction) {
  return junction < 0 ? Json(nullptr) : Json(map.junctions[junction].name);
}

Json lane_of(const Listing& listing, const RoadMap& map, size_t i) {
  const Lane& lane = map.lanes[i];
  const Span<const LanePoint> points = map.points_of(lane);
  Json json{{"type", to_string(lane.type)},
            {"junction", junction_name(map, lane.junction)},
            {"length_m", rounded(lane.length_m)},
            {"speed_limit_mps", rounded(lane.speed_limit_mps)},
            {"endless", lane.is_endless},
            {"successors", lanes_in(map.lane_links, lane.successors)},
            {"predecessors", lanes_in(map.lane_links, lane.predecessors)},
            {"left", lane.left_neighbor},
            {"right", lane.right_neighbor},
            {"points", points.size()},
            {"begin_m", listing.place(points[0].position_m)},
            {"end_m", listing.place(points[points.size() - 1].position_m)}};
  json["source"] = {
      {"road", map.road_names[lane.source_road]}, {"section", lane.source_section}, {"lane", lane.source_lane}};
  return json;
}

void add_paint(Listing& listing, const RoadMap& map) {
  const Provenance& sources = map.provenance;
  listing.add("markings", map.markings.size(), sources.markings, [&](size_t i) {
    const Marking& marking = map.markings[i];
    const auto point = [&](int32_t index) { return listing.place(map.marking_points[index]); };
    return Json{{"color", to_string(marking.color)},      {"broken", marking.broken},
                {"width_m", rounded(marking.width_m)},    {"points", marking.points.size()},
                {"begin_m", point(marking.points.begin)}, {"end_m", point(marking.points.end - 1)}};
  });
  listing.add("road_edges", map.road_edges.size(), sources.road_edges, [&](size_t i) {
    return Json{{"begin_m", listing.place(map.road_edges[i].a_m)}, {"end_m", listing.place(map.road_edges[i].b_m)}};
  });
  listing.add("crosswalks", map.crosswalks.size(), sources.crosswalks, [&](size_t i) {
    Json corners = Json::array();
    const IndexRange outline = map.crosswalks[i].outline;
    for (int32_t k = outline.begin; k < outline.end; ++k) {
      corners.push_back(listing.place(map.outline_points[k]));
    }
    return Json{{"corners_m", corners}};
  });
  listing.add("parking_spaces", map.parking_spaces.size(), sources.parking_spaces, [&](size_t i) {
    const ParkingSpace& space = map.parking_spaces[i];
    return Json{{"center_m", listing.place(space.center_m)},
                {"heading_rad", rounded(space.heading_rad)},
                {"length_m", rounded(space.length_m)},
                {"width_m", rounded(space.width_m)}};
  });
  listing.add("stop_lines", map.stop_lines.size(), sources.stop_lines, [&](size_t i) {
    const PaintedStopLine& line = map.stop_lines[i];
    return Json{
        {"begin_m", listing.place(line.a_m)}, {"end_m", listing.place(line.b_m)}, {"width_m", rounded(line.width_m)}};
  });
}

void add_signals(Listing& listing, const RoadMap& map) {
  const Provenance& sources = map.provenance;
  listing.add("lights", map.lights.size(), sources.lights, [&](size_t i) {
    const TrafficLight& light = map.lights[i];
    return Json{{"name", light.name},
                {"junction", junction_name(map, light.junction)},
                {"phase", light.phase},
                {"head_m", listing.place(light.head_m)},
                {"head_facing", {rounded(light.head_facing.x), rounded(light.head_facing.y)}},
                {"stop_line_m", {listing.place(light.stop_a_m), listing.place(light.stop_b_m)}},
                {"stop_heading_rad", rounded(light.stop_heading_rad)},
                {"lanes", lanes_in(map.light_lanes, light.lanes)}};
  });
  listing.add("signs", map.signs.size(), sources.signs, [&](size_t i) {
    const Sign& sign = map.signs[i];
    return Json{{"name", sign.name},
                {"type", sign.type},
                {"subtype", sign.subtype},
                {"country", sign.country},
                {"position_m", listing.place(sign.position_m)},
                {"heading_rad", rounded(sign.heading_rad)},
                {"lanes", lanes_in(map.sign_lanes, sign.lanes)}};
  });
  listing.add("junctions", map.junctions.size(), sources.junctions,
              [&](size_t i) { return Json{{"name", map.junctions[i].name}, {"phases", map.junctions[i].num_phases}}; });
}

}  // namespace

void print_listing(const Json& facts, const RoadMap& map) {
  Listing listing(facts, map);
  listing.add("lanes", map.lanes.size(), map.provenance.lanes, [&](size_t i) { return lane_of(listing, map, i); });
  add_paint(listing, map);
  add_signals(listing, map);
  listing.add("building_lines", map.building_lines.size(), map.provenance.building_lines, [&](size_t i) {
    const BuildingLine& line = map.building_lines[i];
    return Json{{"begin_m", listing.place(line.a_m)}, {"end_m", listing.place(line.b_m)}};
  });
  listing.print();
}

}  // namespace pictura
