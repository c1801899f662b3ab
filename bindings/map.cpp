// pictura.Map.
#include <algorithm>
#include <tuple>

#include <pybind11/stl.h>

#include "pictura/bindings/call.h"
#include "pictura/bindings/objects.h"
#include "pictura/drawing/world.h"
#include "pictura/map/load_map.h"
#include "pictura/map/map_copy.h"
#include "pictura/map/map_fields.h"

namespace pictura::python {

namespace {

template <typename T>
py::array_t<T> table(size_t rows, size_t columns, const std::function<void(size_t, T*)>& write) {
  py::array_t<T> array(columns == 0 ? std::vector<size_t>{rows} : std::vector<size_t>{rows, columns});
  T* const data = array.mutable_data();
  const size_t step = std::max<size_t>(columns, 1);
  for (size_t i = 0; i < rows; ++i) write(i, data + i * step);
  return array;
}

void put(Vec3 v, float* out) {
  out[0] = v.x;
  out[1] = v.y;
  out[2] = v.z;
}

py::array_t<int32_t> ranges(const auto& elements, IndexRange std::decay_t<decltype(elements[0])>::* range) {
  return table<int32_t>(elements.size(), 2, [&](size_t i, int32_t* out) {
    out[0] = (elements[i].*range).begin;
    out[1] = (elements[i].*range).end;
  });
}

py::dict arrays_of(const RoadMap& map) {
  py::dict d;
  d["lane_points"] = table<float>(map.lane_points.size(), 6, [&](size_t i, float* out) {
    const LanePoint& point = map.lane_points[i];
    put(point.position_m, out);
    out[3] = point.heading_rad;
    out[4] = point.width_m;
    out[5] = point.s_m;
  });
  d["lane_point_range"] = ranges(map.lanes, &Lane::points);
  d["lane_type"] = table<uint8_t>(map.lanes.size(), 0,
                                  [&](size_t i, uint8_t* out) { *out = static_cast<uint8_t>(map.lanes[i].type); });
  d["lane_speed_limit_mps"] =
      table<float>(map.lanes.size(), 0, [&](size_t i, float* out) { *out = map.lanes[i].speed_limit_mps; });
  d["lane_length_m"] = table<float>(map.lanes.size(), 0, [&](size_t i, float* out) { *out = map.lanes[i].length_m; });
  d["lane_neighbors"] = table<int32_t>(map.lanes.size(), 2, [&](size_t i, int32_t* out) {
    out[0] = map.lanes[i].left_neighbor;
    out[1] = map.lanes[i].right_neighbor;
  });
  d["lane_successor_range"] = ranges(map.lanes, &Lane::successors);
  d["lane_predecessor_range"] = ranges(map.lanes, &Lane::predecessors);
  d["lane_links"] = table<int32_t>(map.lane_links.size(), 0, [&](size_t i, int32_t* out) { *out = map.lane_links[i]; });
  d["marking_points"] =
      table<float>(map.marking_points.size(), 3, [&](size_t i, float* out) { put(map.marking_points[i], out); });
  d["marking_point_range"] = ranges(map.markings, &Marking::points);
  d["road_edges"] = table<float>(map.road_edges.size(), 6, [&](size_t i, float* out) {
    put(map.road_edges[i].a_m, out);
    put(map.road_edges[i].b_m, out + 3);
  });
  d["crosswalk_points"] =
      table<float>(map.outline_points.size(), 3, [&](size_t i, float* out) { put(map.outline_points[i], out); });
  d["crosswalk_point_range"] = ranges(map.crosswalks, &Crosswalk::outline);
  d["stop_lines"] = table<float>(map.lights.size(), 6, [&](size_t i, float* out) {
    put(map.lights[i].stop_a_m, out);
    put(map.lights[i].stop_b_m, out + 3);
  });
  d["light_heads"] = table<float>(map.lights.size(), 3, [&](size_t i, float* out) { put(map.lights[i].head_m, out); });
  d["building_lines"] = table<float>(map.building_lines.size(), 6, [&](size_t i, float* out) {
    put(map.building_lines[i].a_m, out);
    put(map.building_lines[i].b_m, out + 3);
  });
  return d;
}

/// Returns (kind, action, message) for each fault that was repaired in the map's file.
std::vector<std::tuple<std::string, std::string, std::string>> repairs_of(const Map& map) {
  std::vector<std::tuple<std::string, std::string, std::string>> repairs;
  for (const Repair& repair : map.road()->mends) {
    repairs.emplace_back(to_string(repair.kind), action_of(repair.kind), message_of(repair, map.source()));
  }
  return repairs;
}

std::shared_ptr<Map> load_named_map(const std::string& name, bool strict, float chord_error_m) {
  OpenDriveOptions options;
  options.strict = strict;
  options.chord_error_m = chord_error_m;
  return run_interruptibly("load_map", 1, {}, [name, options] {
    LoadReport report;
    auto road = load_map(name, options, &report);
    return std::make_shared<Map>(std::move(road), std::move(report.source));
  });
}

std::shared_ptr<Map> from_text(const std::string& text, const std::string& source, bool strict) {
  return run_interruptibly("Map.from_text", 1, {}, [text, source, strict] {
    OpenDriveOptions options;
    options.strict = strict;
    return std::make_shared<Map>(std::make_shared<RoadMap>(parse_opendrive(text, source, options)), source);
  });
}

}  // namespace

py::array_t<uint8_t> draw(const RoadMap& map, int width_px, int height_px, const Scenario* scenario, int step) {
  RgbImage image;
  {
    const GilRelease no_gil;
    WorldPainter painter(map, width_px, height_px, {}, scenario);
    const std::vector<LightState> lights(map.lights.size(), LightState::off);
    WorldFrame frame;
    frame.lights = lights;
    frame.recorded_step = step;
    image = painter.draw(frame, painter.whole_map());
  }
  py::array_t<uint8_t> pixels({image.height_px, image.width_px, 3});
  std::copy(image.rgb.begin(), image.rgb.end(), pixels.mutable_data());
  return pixels;
}

std::shared_ptr<const CompiledMap> Map::compiled(const MapOptions& options) {
  for (const auto& made : compiled_) {
    if (made->options == options) return made;
  }
  compiled_.push_back(run_interruptibly("map", 1, {}, compilation(options)));
  return compiled_.back();
}

std::function<std::shared_ptr<const CompiledMap>()> Map::compilation(const MapOptions& options) const {
  return [road = road_, options] { return compile_map(road, options); };
}

py::dict facts_of(const MapFacts& facts) {
  py::dict d;
  visit_fields(facts, [&d](const std::string& name, const auto& value) { d[py::str(name)] = value; });
  return d;
}

void bind_maps(py::module_& module) {
  py::class_<Geometry>(module, "Geometry", R"(
Geometry of a map for renderers: strips on the road, walls, light heads.

Examples:
    >>> pictura.Map.load('procedural:3').geometry(walls=False).num_walls
    0
    >>> line = ([[0, 0, 0], [100, 0, 0]], 0.2, (1, 1, 1))     # points in m, width in m, white
    >>> pictura.Geometry([line], walls=[[0, 5, 0, 50, 5, 0, 3]]).num_walls
    1)")
      .def(py::init([](const std::vector<std::tuple<py::array_t<float, py::array::c_style | py::array::forcecast>,
                                                    float, std::array<float, 3>>>& lines,
                       const py::array_t<float, py::array::c_style | py::array::forcecast>& walls) {
             auto geometry = std::make_shared<StaticGeometry>();
             for (const auto& [points, width_m, color] : lines) {
               PICTURA_CHECK(points.ndim() == 2 && points.shape(1) == 3 && points.shape(0) >= 2,
                             "Geometry: lines: expected points of shape [n, 3], n at least 2");
               std::vector<Vec3> line;
               for (py::ssize_t i = 0; i < points.shape(0); ++i) {
                 line.push_back({points.at(i, 0), points.at(i, 1), points.at(i, 2)});
               }
               append_strips(line, width_m, {color[0], color[1], color[2]}, StripKind::lane_mark, &geometry->strips);
             }
             PICTURA_CHECK(walls.size() == 0 || (walls.ndim() == 2 && walls.shape(1) == 7),
                           "Geometry: walls: expected [n, 7]: both ends of the foot and the height");
             for (py::ssize_t i = 0; walls.size() > 0 && i < walls.shape(0); ++i) {
               WallFace wall;
               wall.a_m = {walls.at(i, 0), walls.at(i, 1), walls.at(i, 2)};
               wall.b_m = {walls.at(i, 3), walls.at(i, 4), walls.at(i, 5)};
               wall.height_m = walls.at(i, 6);
               geometry->walls.push_back(wall);
             }
             geometry->build_grids();
             return Geometry{geometry};
           }),
           py::arg("lines") = py::list(), py::arg("walls") = py::array_t<float>(std::vector<size_t>{0, 7}),
           R"(Creates a custom geometry.

lines: list of (points [n, 3] in metres, width in metres, RGB colour with values in [0, 1]).
walls: float [n, 7]: both ends of a wall on the ground (x, y, z, x, y, z) and its height, in metres.
Raises pictura.Error for other shapes. Renderers reject numbers that are not finite.)")
      .def_property_readonly(
          "num_strips", [](const Geometry& self) { return self.geometry->strips.size(); },
          py::doc("Number of straight pieces of lines."))
      .def_property_readonly(
          "num_walls", [](const Geometry& self) { return self.geometry->walls.size(); },
          py::doc("Number of wall faces."))
      .def_property_readonly(
          "num_lights", [](const Geometry& self) { return self.geometry->num_signals; },
          py::doc("Number of traffic light states in each world with this geometry."));

  py::class_<Map, std::shared_ptr<Map>>(module, "Map", R"(
Road network: lanes, markings, edges and traffic lights. A map is immutable, so simulators and renderers can share it.

Positions are in metres in the map's frame, with z up. `origin_m` is the origin of this frame in the file's coordinates.

Examples:
    >>> town = pictura.Map.load('procedural:3')                # or 'Town01', 'city:1', 'mytown.xodr'
    >>> town.name, town.draw(320, 200).shape
    ('procedural:3', (200, 320, 3))
    >>> town.arrays()['lane_points'].shape[1]                  # x, y, z, heading, width, arc length
    6)")
      .def_static(
          "load", load_named_map, py::arg("name"), py::kw_only(), py::arg("strict") = false,
          py::arg("chord_error_m") = OpenDriveOptions{}.chord_error_m,
          R"(Loads or generates a map by name: an OpenDRIVE file (.xodr), a Lanelet2 file (.osm), a town in the folder map_folder(),
'procedural:SEED', or 'city:SEED'. For FILE.osm@LATITUDE,LONGITUDE this place is the origin of coordinates.

Faults of a file that have only one sensible repair are repaired, and listed in `mends`.
strict: rejects files with such faults instead.
chord_error_m: maximum distance in metres between a curve and the polyline that approximates it.
Raises pictura.Error, which names file, line and element, for an invalid file, and pictura.UsageError if the map does
not exist.)")
      .def_static("from_text", from_text, py::arg("text"), py::arg("source") = "text", py::kw_only(),
                  py::arg("strict") = false,
                  "Parses the text of an OpenDRIVE file. source: name of the text in error messages. Raises the same "
                  "errors as load().")
      .def_property_readonly(
          "name", [](const Map& self) { return self.road()->name; },
          py::doc("Name of the map: 'Town01', 'procedural:7', or the file's stem."))
      .def_property_readonly("mends", repairs_of,
                             py::doc("Repaired faults of the file, a tuple (kind, repair, message) for each."))
      .def_property_readonly(
          "origin_m", [](const Map& self) { return self.road()->origin_m; },
          py::doc("The map's origin in the file's coordinates, three floats in metres."))
      .def_property_readonly(
          "geo_reference", [](const Map& self) { return self.road()->geo_reference; },
          py::doc("PROJ string of the file's coordinates; may be empty."))
      .def_property_readonly(
          "facts", [](const Map& self) { return facts_of(self.road()->facts); },
          py::doc("Dict of counts and lengths, as `pictura map` prints them."))
      .def(
          "arrays", [](const Map& self) { return arrays_of(*self.road()); },
          R"(Returns copies of the network's geometry as a dict of NumPy arrays. Lengths are in metres.

lane_points float32 [points, 6]: x, y, z, heading in radians, width, arc length. lane_point_range int32 [lanes, 2]: the
half-open range of each lane's points. lane_type uint8 [lanes]: indices into pictura.LANE_TYPES. lane_links int32:
successors and predecessors of all lanes. road_edges, stop_lines, building_lines float32 [n, 6]: both ends of each
segment.)")
      .def(
          "geometry",
          [](Map& self, bool walls, uint64_t wall_seed, const std::string& light_heads) {
            const auto compiled =
                self.compiled({.walls = walls, .wall_seed = wall_seed, .light_heads = light_heads_named(light_heads)});
            return Geometry{std::shared_ptr<const StaticGeometry>(compiled, &compiled->geometry)};
          },
          py::arg("walls") = true, py::arg("wall_seed") = 0, py::arg("light_heads") = name_of(MapOptions{}.light_heads),
          R"(Returns the map's geometry for renderers. walls: adds walls along the building lines; wall_seed is the random seed of
their heights. light_heads: as for Simulator.)")
      .def(
          "draw", [](const Map& self, int width_px, int height_px) { return draw(*self.road(), width_px, height_px); },
          py::arg("width_px") = 1024, py::arg("height_px") = 1024,
          "Draws the map from above. Returns uint8 [height, width, 3], with north at the top. Sizes are from 16 to "
          "8192 px.")
      .def("__repr__", [](const Map& self) {
        return fmt::format("<pictura.Map {}: {} lanes, {:.1f} km>", self.road()->name, self.road()->lanes.size(),
                           self.road()->facts.driving_lane_km);
      });
  module.def("_expand_map_names", expand_map_names, py::arg("names"),
             "Returns the names of maps, in which each range of generated towns, such as 'procedural:1000-1011', is "
             "expanded.");
  module.def("map_folder", map_folder, R"(
Returns the folder in which load() looks for towns: $PICTURA_DATA, or the user's data folder.

Examples:
    >>> isinstance(pictura.map_folder(), str)
    True)");
  module.def("known_towns", known_towns, R"(
Returns the names of the towns in the map folder, sorted.

Examples:
    >>> pictura.known_towns()      # doctest: +SKIP
    ['Town01', 'Town02', 'Town03'])");
  py::list types;
  for (int i = 0; i <= static_cast<int>(LaneType::other); ++i) types.append(to_string(static_cast<LaneType>(i)));
  module.attr("LANE_TYPES") = py::tuple(types);
}

}  // namespace pictura::python
