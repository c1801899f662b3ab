#include "pictura/bindings/scene_arrays.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>
#include <string_view>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include "pictura/bindings/arrays.h"
#include "pictura/common/support/suggestion.h"

namespace pictura::python {

namespace {

constexpr const char* kLineTypes[] = {
    "unknown",
    "broken_single_white",
    "solid_single_white",
    "solid_double_white",
    "broken_single_yellow",
    "broken_double_yellow",
    "solid_single_yellow",
    "solid_double_yellow",
    "passing_double_yellow",
    "dash_white",
    "dash_yellow",
};
static_assert(std::size(kLineTypes) == static_cast<size_t>(LoggedLineType::dash_yellow) + 1);
constexpr int64_t kTrackTypes = static_cast<int64_t>(TrackType::other) + 1;
constexpr int64_t kLaneTypes = static_cast<int64_t>(LaneType::other) + 1;
constexpr int64_t kLightStates = static_cast<int64_t>(RecordedLightState::flashing_caution) + 1;
constexpr double kMaxWidth_m = 50, kMaxLimit_mps = 1000;
constexpr int64_t kNoLane = -1;

using Shape = std::vector<py::ssize_t>;
constexpr py::ssize_t kAnyLength = -1;

template <typename T>
using Numbers = py::array_t<T, py::array::c_style | py::array::forcecast>;

std::string text_of(const Shape& shape) {
  std::string text;
  for (const py::ssize_t length : shape) {
    text += fmt::format("{}{}", text.empty() ? "" : ", ", length == kAnyLength ? "n" : std::to_string(length));
  }
  return "[" + text + "]";
}

/// Reader of the arrays in a dict.
class ArrayReader {
 public:
  ArrayReader(std::string name, py::dict arrays, const std::vector<std::string>& known)
      : name_(std::move(name)), arrays_(std::move(arrays)) {
    for (const auto& [key, value] : arrays_) {
      const std::string text = py::cast<std::string>(py::str(key));
      if (std::find(known.begin(), known.end(), text) != known.end()) continue;
      fail_usage("{}: expected {}, got '{}'", name_, fmt::join(known, ", "), text);
    }
  }

  bool has(const char* key) const { return arrays_.contains(key) && !arrays_[key].is_none(); }

  std::string place(const char* key) const { return fmt::format("{}['{}']", name_, key); }
  std::string place(const char* key, py::ssize_t index) const { return fmt::format("{}[{}]", place(key), index); }

  /// Reads finite numbers in [minimum, largest]. Rows whose element of `where` is 0 may contain any values.
  Numbers<double> numbers(const char* key, const Shape& shape, double minimum = -1e9, double largest = 1e9,
                          const uint8_t* where = nullptr) const {
    const Numbers<double> array = read<double>(key, shape, "biuf", "numbers");
    const py::ssize_t row = array.ndim() > 2 ? array.shape(array.ndim() - 1) : 1;
    for (py::ssize_t i = 0; i < array.size(); ++i) {
      if (where && !where[i / row]) continue;
      const double value = array.data()[i];
      if (value >= minimum && value <= largest) continue;
      if (!std::isfinite(value)) fail_usage("{}: expected a finite number, got {}", element(key, array, i), value);
      fail_usage("{}: expected a number in [{:g}, {:g}], got {:g}", element(key, array, i), minimum, largest, value);
    }
    return array;
  }

  Numbers<int64_t> integers(const char* key, const Shape& shape) const {
    return read<int64_t>(key, shape, "iu", "integers");
  }

  /// Reads indices in the list pictura.NAMES, where NAMES is the value of `names`. The list has `count` elements.
  Numbers<int64_t> codes(const char* key, const Shape& shape, int64_t count, const char* names) const {
    const Numbers<int64_t> array = integers(key, shape);
    for (py::ssize_t i = 0; i < array.size(); ++i) {
      const int64_t code = array.data()[i];
      if (code >= 0 && code < count) continue;
      fail_usage("{}: expected an index in [0, {}) of pictura.{}, got {}", element(key, array, i), count, names, code);
    }
    return array;
  }

  Numbers<uint8_t> flags(const char* key, const Shape& shape) const {
    const Numbers<int64_t> array = read<int64_t>(key, shape, "biu", "booleans");
    Numbers<uint8_t> flags(Shape(array.shape(), array.shape() + array.ndim()));
    for (py::ssize_t i = 0; i < array.size(); ++i) {
      const int64_t value = array.data()[i];
      if (value != 0 && value != 1) fail_usage("{}: expected 0 or 1, got {}", element(key, array, i), value);
      flags.mutable_data()[i] = static_cast<uint8_t>(value);
    }
    return flags;
  }

  /// Reads offsets of items in a list of `total` elements: where the elements of each item begin, and the end of the
  /// last item.
  Numbers<int64_t> begins(const char* key, py::ssize_t items, py::ssize_t total) const {
    const Numbers<int64_t> array = integers(key, {items == kAnyLength ? kAnyLength : items + 1});
    if (array.size() == 0) fail_usage("{}: expected at least [0], got an empty array", place(key));
    for (py::ssize_t i = 0; i < array.size(); ++i) {
      const int64_t minimum = i == 0 ? 0 : array.data()[i - 1];
      const int64_t most = i == 0 ? 0 : total;
      const bool is_last = i + 1 == array.size();
      if (array.data()[i] >= minimum && array.data()[i] <= most && (!is_last || array.data()[i] == total)) continue;
      fail_usage("{}: expected {}, got {}", place(key, i),
                 is_last  ? fmt::format("{}, the number of elements", total)
                 : i == 0 ? "0"
                          : fmt::format("{} to {}", minimum, most),
                 array.data()[i]);
    }
    return array;
  }

  std::vector<LoggedPoints> polylines(py::ssize_t items = kAnyLength) const {
    const Numbers<double> points = numbers("points", {kAnyLength, 3});
    const Numbers<int64_t> begin = begins("begin", items, points.shape(0));
    std::vector<LoggedPoints> lines(static_cast<size_t>(begin.size() - 1));
    for (size_t i = 0; i < lines.size(); ++i) {
      for (int64_t k = begin.data()[i]; k < begin.data()[i + 1]; ++k) {
        lines[i].emplace_back(points.data() + 3 * k);
      }
    }
    return lines;
  }

  /// Reads lists of lane ids from two arrays: KEY contains all ids, one list after the other, and KEY_begin the offsets
  /// of lists.
  std::vector<std::vector<int64_t>> lane_lists(const char* key, py::ssize_t items,
                                               const std::set<int64_t>& lanes) const {
    const Numbers<int64_t> ids = integers(key, {kAnyLength});
    for (py::ssize_t i = 0; i < ids.size(); ++i) check_lane(key, i, ids.data()[i], lanes);
    const Numbers<int64_t> begin = begins(fmt::format("{}_begin", key).c_str(), items, ids.size());
    std::vector<std::vector<int64_t>> lists;
    for (py::ssize_t i = 0; i + 1 < begin.size(); ++i) {
      lists.emplace_back(ids.data() + begin.data()[i], ids.data() + begin.data()[i + 1]);
    }
    return lists;
  }

  void check_lane(const char* key, py::ssize_t index, int64_t id, const std::set<int64_t>& lanes) const {
    if (!lanes.contains(id)) fail_usage("{}: expected the id of a lane, got {}", place(key, index), id);
  }

 private:
  std::string element(const char* key, const py::array& array, py::ssize_t index) const {
    Shape indices;
    for (py::ssize_t axis = array.ndim(); axis-- > 0; index /= array.shape(axis)) {
      indices.insert(indices.begin(), index % array.shape(axis));
    }
    return place(key) + text_of(indices);
  }

  template <typename T>
  Numbers<T> read(const char* key, const Shape& shape, std::string_view kinds, const char* expected) const {
    if (!arrays_.contains(key)) fail_usage("{}: expected an array of shape {}, got None", place(key), text_of(shape));
    const py::array given = py::array::ensure(arrays_[key]);
    if (!given) {
      PyErr_Clear();
      fail_usage("{}: expected an array, got {}", place(key), type_name_of(arrays_[key]));
    }
    const Shape got(given.shape(), given.shape() + given.ndim());
    const bool fits = std::equal(shape.begin(), shape.end(), got.begin(), got.end(),
                                 [](auto wanted, auto length) { return wanted == kAnyLength || wanted == length; });
    if (!fits) fail_usage("{}: expected shape {}, got {}", place(key), text_of(shape), text_of(got));
    // An empty array may have any type, because NumPy converts an empty list to an array of floats.
    if (given.size() > 0 && kinds.find(given.dtype().kind()) == std::string_view::npos) {
      fail_usage("{}: expected {}, got {}", place(key), expected, py::cast<std::string>(py::str(given.dtype())));
    }
    return Numbers<T>(given);
  }

  std::string name_;
  py::dict arrays_;
};

void read_tracks(const py::dict& given, LoggedScene* scene) {
  const ArrayReader arrays("tracks", given,
                           {"id", "type", "size_m", "position_m", "heading_rad", "velocity_mps", "valid"});
  const Numbers<int64_t> id = arrays.integers("id", {kAnyLength});
  const py::ssize_t tracks = id.size();
  const Numbers<int64_t> type = arrays.codes("type", {tracks}, kTrackTypes, "TRACK_TYPES");
  const Numbers<double> size = arrays.numbers("size_m", {tracks, 3});
  const Numbers<uint8_t> valid = arrays.flags("valid", {tracks, kAnyLength});
  const py::ssize_t steps = valid.shape(1);
  if (steps < 1 || steps > kMaxScenarioSteps) {
    fail_usage("{}: expected 1 to {} steps, got {}", arrays.place("valid"), kMaxScenarioSteps, steps);
  }
  const auto of_states = [&](const char* key, const Shape& shape) {
    return arrays.numbers(key, shape, -1e9, 1e9, valid.data());
  };
  const Numbers<double> position = of_states("position_m", {tracks, steps, 3});
  const Numbers<double> velocity = of_states("velocity_mps", {tracks, steps, 2});
  const Numbers<double> heading = of_states("heading_rad", {tracks, steps});
  scene->num_steps = static_cast<int32_t>(steps);
  for (py::ssize_t i = 0; i < tracks; ++i) {
    LoggedTrack& track = scene->tracks.emplace_back();
    track.id = id.data()[i];
    track.type = static_cast<TrackType>(type.data()[i]);
    for (py::ssize_t k = i * steps; k < (i + 1) * steps; ++k) {
      LoggedState& state = track.states.emplace_back();
      if (!valid.data()[k]) continue;
      state = {.center_m = Eigen::Vector3d(position.data() + 3 * k),
               .heading_rad = heading.data()[k],
               .velocity_x_mps = velocity.data()[2 * k],
               .velocity_y_mps = velocity.data()[2 * k + 1],
               .length_m = size.data()[3 * i],
               .width_m = size.data()[3 * i + 1],
               .height_m = size.data()[3 * i + 2],
               .valid = true};
    }
  }
}

/// Reads the lanes and returns their ids.
std::set<int64_t> read_lanes(const py::dict& given, LoggedScene* scene) {
  const ArrayReader arrays("lanes", given,
                           {"id", "type", "points", "begin", "speed_limit_mps", "width_m", "in_junction", "entries",
                            "entries_begin", "exits", "exits_begin", "left_neighbor", "right_neighbor"});
  const Numbers<int64_t> id = arrays.integers("id", {kAnyLength});
  const py::ssize_t lanes = id.size();
  std::set<int64_t> ids;
  for (py::ssize_t i = 0; i < lanes; ++i) {
    if (id.data()[i] < 0) fail_usage("{}: expected an id of 0 or more, got {}", arrays.place("id", i), id.data()[i]);
    if (ids.insert(id.data()[i]).second) continue;
    fail_usage("{}: expected a unique id, got {} again", arrays.place("id", i), id.data()[i]);
  }
  const Numbers<int64_t> type = arrays.codes("type", {lanes}, kLaneTypes, "LANE_TYPES");
  std::vector<LoggedPoints> lines = arrays.polylines(lanes);
  for (py::ssize_t i = 0; i < lanes; ++i) {
    scene->lanes.push_back({.id = id.data()[i],
                            .map_type = static_cast<LaneType>(type.data()[i]),
                            .points = std::move(lines[static_cast<size_t>(i)])});
  }
  const auto for_each_lane = [&](const auto& work) {
    for (size_t i = 0; i < scene->lanes.size(); ++i) work(scene->lanes[i], i);
  };
  if (arrays.has("speed_limit_mps")) {
    const Numbers<double> limit = arrays.numbers("speed_limit_mps", {lanes}, 0, kMaxLimit_mps);
    for_each_lane([&](LoggedLane& lane, size_t i) { lane.speed_limit_mps = limit.data()[i]; });
  }
  if (arrays.has("in_junction")) {
    const Numbers<uint8_t> in_junction = arrays.flags("in_junction", {lanes});
    for_each_lane([&](LoggedLane& lane, size_t i) { lane.interpolating = in_junction.data()[i] != 0; });
  }
  if (arrays.has("width_m")) {
    size_t points = 0;
    for_each_lane([&](const LoggedLane& lane, size_t) { points += lane.points.size(); });
    const Numbers<double> width = arrays.numbers("width_m", {static_cast<py::ssize_t>(points)}, 0, kMaxWidth_m);
    const double* next = width.data();
    for_each_lane([&](LoggedLane& lane, size_t) {
      const double* const end = next + lane.points.size();
      if (std::any_of(next, end, [](double width_m) { return width_m > 0; })) lane.widths_m.assign(next, end);
      next = end;
    });
  }
  const auto read_links = [&](const char* key, std::vector<int64_t> LoggedLane::* links) {
    if (!arrays.has(key)) return false;
    const auto lists = arrays.lane_lists(key, lanes, ids);
    for_each_lane([&](LoggedLane& lane, size_t i) { lane.*links = lists[i]; });
    return true;
  };
  const bool has_entries = read_links("entries", &LoggedLane::entries);
  scene->has_links = read_links("exits", &LoggedLane::exits) || has_entries;
  const auto read_neighbors = [&](const char* key, std::vector<LoggedNeighbor> LoggedLane::* neighbors) {
    if (!arrays.has(key)) return;
    const Numbers<int64_t> neighbor = arrays.integers(key, {lanes});
    for_each_lane([&](LoggedLane& lane, size_t i) {
      const int64_t other = neighbor.data()[i];
      if (other == kNoLane) return;
      arrays.check_lane(key, static_cast<py::ssize_t>(i), other, ids);
      (lane.*neighbors).push_back({.lane = other});
    });
  };
  read_neighbors("left_neighbor", &LoggedLane::left_neighbors);
  read_neighbors("right_neighbor", &LoggedLane::right_neighbors);
  return ids;
}

void read_lines(const py::dict& given, LoggedScene* scene) {
  const ArrayReader arrays("lines", given, {"type", "points", "begin"});
  std::vector<LoggedPoints> lines = arrays.polylines();
  const Numbers<int64_t> type =
      arrays.codes("type", {static_cast<py::ssize_t>(lines.size())}, std::size(kLineTypes), "LINE_TYPES");
  for (size_t i = 0; i < lines.size(); ++i) {
    scene->lines.push_back({.id = static_cast<int64_t>(i),
                            .type = static_cast<LoggedLineType>(type.data()[i]),
                            .points = std::move(lines[i])});
  }
}

template <typename Feature>
void read_features(const char* name, const py::dict& given, std::vector<Feature>* out) {
  const ArrayReader arrays(name, given, {"points", "begin"});
  for (LoggedPoints& points : arrays.polylines()) {
    out->push_back({.id = static_cast<int64_t>(out->size()), .points = std::move(points)});
  }
}

void read_stop_signs(const py::dict& given, const std::set<int64_t>& lanes, LoggedScene* scene) {
  const ArrayReader arrays("stop_signs", given, {"position_m", "lanes", "lanes_begin"});
  const Numbers<double> position = arrays.numbers("position_m", {kAnyLength, 3});
  std::vector<std::vector<int64_t>> held = arrays.lane_lists("lanes", position.shape(0), lanes);
  for (size_t i = 0; i < held.size(); ++i) {
    scene->stop_signs.push_back({.id = static_cast<int64_t>(i),
                                 .lanes = std::move(held[i]),
                                 .position_m = Eigen::Vector3d(position.data() + 3 * i)});
  }
}

void read_lights(const py::dict& given, const std::set<int64_t>& lanes, LoggedScene* scene) {
  const ArrayReader arrays("lights", given, {"lanes", "lanes_begin", "stop_lines", "states"});
  const py::ssize_t steps = scene->num_steps;
  const Numbers<int64_t> states = arrays.codes("states", {kAnyLength, steps}, kLightStates, "LIGHT_STATES");
  const py::ssize_t lights = states.shape(0);
  std::vector<std::vector<int64_t>> held = arrays.lane_lists("lanes", lights, lanes);
  std::optional<Numbers<double>> stop_lines;
  if (arrays.has("stop_lines")) stop_lines = arrays.numbers("stop_lines", {lights, 2, 3});
  for (py::ssize_t i = 0; i < lights; ++i) {
    LoggedLight& light = scene->lights.emplace_back();
    light.lanes = std::move(held[static_cast<size_t>(i)]);
    if (light.lanes.empty()) fail_usage("{}: expected at least one lane of light {}", arrays.place("lanes"), i);
    light.has_stop_line = stop_lines.has_value();
    if (stop_lines) {
      light.stop_a_m = Eigen::Vector3d(stop_lines->data() + 6 * i);
      light.stop_b_m = Eigen::Vector3d(stop_lines->data() + 6 * i + 3);
    }
    for (py::ssize_t k = i * steps; k < (i + 1) * steps; ++k) {
      light.states.push_back(static_cast<RecordedLightState>(states.data()[k]));
    }
  }
}

/// Creates an array from its elements in row-major order.
template <typename T>
py::array array_of(const Shape& shape, const std::vector<T>& values) {
  return py::array_t<T>(shape, values.data());
}
template <typename T>
py::array array_of(const std::vector<T>& values) {
  return array_of(Shape{static_cast<py::ssize_t>(values.size())}, values);
}

void append(const Eigen::Vector3d& p, std::vector<double>* out) { out->insert(out->end(), {p.x(), p.y(), p.z()}); }

template <typename Feature>
py::dict polylines_of(const std::vector<Feature>& features) {
  std::vector<double> points;
  std::vector<int32_t> begin{0};
  for (const Feature& feature : features) {
    for (const Eigen::Vector3d& p : feature.points) append(p, &points);
    begin.push_back(begin.back() + static_cast<int32_t>(feature.points.size()));
  }
  py::dict d;
  d["points"] = array_of({begin.back(), 3}, points);
  d["begin"] = array_of(begin);
  return d;
}

template <typename Item>
void put_lists(const char* key, const std::vector<Item>& items, std::vector<int64_t> Item::* list, py::dict* out) {
  std::vector<int64_t> ids;
  std::vector<int32_t> begin{0};
  for (const Item& item : items) {
    ids.insert(ids.end(), (item.*list).begin(), (item.*list).end());
    begin.push_back(static_cast<int32_t>(ids.size()));
  }
  (*out)[key] = array_of(ids);
  (*out)[fmt::format("{}_begin", key).c_str()] = array_of(begin);
}

py::dict tracks_of(const LoggedScene& scene) {
  const auto tracks = static_cast<py::ssize_t>(scene.tracks.size());
  const py::ssize_t steps = scene.num_steps;
  std::vector<int64_t> id;
  std::vector<uint8_t> type, valid;
  std::vector<double> size, position, heading, velocity;
  for (const LoggedTrack& track : scene.tracks) {
    id.push_back(track.id);
    type.push_back(static_cast<uint8_t>(track.type));
    size.insert(size.end(), {track.states[0].length_m, track.states[0].width_m, track.states[0].height_m});
    for (const LoggedState& state : track.states) {
      append(state.center_m, &position);
      heading.push_back(state.heading_rad);
      velocity.insert(velocity.end(), {state.velocity_x_mps, state.velocity_y_mps});
      valid.push_back(state.valid ? 1 : 0);
    }
  }
  py::dict d;
  d["id"] = array_of(id);
  d["type"] = array_of(type);
  d["size_m"] = array_of({tracks, 3}, size);
  d["position_m"] = array_of({tracks, steps, 3}, position);
  d["heading_rad"] = array_of({tracks, steps}, heading);
  d["velocity_mps"] = array_of({tracks, steps, 2}, velocity);
  d["valid"] = array_of({tracks, steps}, valid).attr("view")("bool");
  return d;
}

py::dict lanes_of(const std::vector<LoggedLane>& lanes) {
  std::vector<int64_t> id, left, right;
  std::vector<uint8_t> type, in_junction;
  std::vector<double> limit, width;
  const auto neighbor = [](const std::vector<LoggedNeighbor>& neighbors) {
    return neighbors.empty() ? kNoLane : neighbors[0].lane;
  };
  for (const LoggedLane& lane : lanes) {
    id.push_back(lane.id);
    type.push_back(static_cast<uint8_t>(lane.map_type.value_or(LaneType::other)));
    limit.push_back(lane.speed_limit_mps);
    in_junction.push_back(lane.interpolating ? 1 : 0);
    width.insert(width.end(), lane.widths_m.begin(), lane.widths_m.end());
    left.push_back(neighbor(lane.left_neighbors));
    right.push_back(neighbor(lane.right_neighbors));
  }
  py::dict d = polylines_of(lanes);
  d["id"] = array_of(id);
  d["type"] = array_of(type);
  d["speed_limit_mps"] = array_of(limit);
  d["width_m"] = array_of(width);
  d["in_junction"] = array_of(in_junction).attr("view")("bool");
  put_lists("entries", lanes, &LoggedLane::entries, &d);
  put_lists("exits", lanes, &LoggedLane::exits, &d);
  d["left_neighbor"] = array_of(left);
  d["right_neighbor"] = array_of(right);
  return d;
}

py::dict lines_of(const std::vector<LoggedLine>& lines) {
  std::vector<uint8_t> type;
  for (const LoggedLine& line : lines) type.push_back(static_cast<uint8_t>(line.type));
  py::dict d = polylines_of(lines);
  d["type"] = array_of(type);
  return d;
}

py::dict stop_signs_of(const std::vector<LoggedStopSign>& signs) {
  std::vector<double> position;
  for (const LoggedStopSign& sign : signs) append(sign.position_m, &position);
  py::dict d;
  d["position_m"] = array_of({static_cast<py::ssize_t>(signs.size()), 3}, position);
  put_lists("lanes", signs, &LoggedStopSign::lanes, &d);
  return d;
}

py::dict lights_of(const LoggedScene& scene) {
  const auto lights = static_cast<py::ssize_t>(scene.lights.size());
  std::vector<double> stop_lines;
  std::vector<uint8_t> states;
  for (const LoggedLight& light : scene.lights) {
    append(light.stop_a_m, &stop_lines);
    append(light.stop_b_m, &stop_lines);
    for (const RecordedLightState state : light.states) states.push_back(static_cast<uint8_t>(state));
  }
  py::dict d;
  put_lists("lanes", scene.lights, &LoggedLight::lanes, &d);
  d["stop_lines"] = array_of({lights, 2, 3}, stop_lines);
  d["states"] = array_of({lights, scene.num_steps}, states);
  return d;
}

}  // namespace

LoggedScene scene_from_arrays(const SceneArrays& arrays) {
  LoggedScene scene;
  scene.source = "Scenario.from_arrays";
  scene.names = {.tracks = "tracks", .features = "lanes"};
  scene.format = "arrays";
  scene.is_authored = true;
  read_tracks(arrays.tracks, &scene);
  const std::set<int64_t> lanes = read_lanes(arrays.lanes, &scene);
  if (arrays.lines) read_lines(*arrays.lines, &scene);
  if (arrays.edges) read_features("edges", *arrays.edges, &scene.edges);
  if (arrays.crosswalks) read_features("crosswalks", *arrays.crosswalks, &scene.crosswalks);
  if (arrays.stop_signs) read_stop_signs(*arrays.stop_signs, lanes, &scene);
  if (arrays.lights) read_lights(*arrays.lights, lanes, &scene);
  return scene;
}

py::dict to_arrays(const LoggedScene& scene) {
  py::dict d;
  d["tracks"] = tracks_of(scene);
  d["lanes"] = lanes_of(scene.lanes);
  d["lines"] = lines_of(scene.lines);
  d["edges"] = polylines_of(scene.edges);
  d["crosswalks"] = polylines_of(scene.crosswalks);
  d["stop_signs"] = stop_signs_of(scene.stop_signs);
  d["lights"] = lights_of(scene);
  return d;
}

void bind_scene_names(py::module_& module) {
  module.attr("LINE_TYPES") =
      py::tuple(py::cast(std::vector<std::string>(std::begin(kLineTypes), std::end(kLineTypes))));
  py::list states;
  for (int64_t i = 0; i < kLightStates; ++i) states.append(to_string(static_cast<RecordedLightState>(i)));
  module.attr("LIGHT_STATES") = py::tuple(states);
}

}  // namespace pictura::python
