#include "pictura/tests/support/scene_fixture.h"

#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <map>
#include <numbers>
#include <random>

#include <fmt/ranges.h>

#include "pictura/common/support/crc32c.h"

namespace pictura::test {

namespace {

using Eigen::Vector3d;

constexpr double kCenterX_m = -7887.25, kCenterY_m = 6796.5, kGround_m = -186.0;
constexpr double kArm_m = 12, kHalfLane_m = 1.75, kSpacing_m = 0.5;
constexpr double kPi64 = std::numbers::pi;

/// Returns a point of the crossing, turned by `arm` quarters.
Vector3d place(double x, double y, int arm, double z = 0) {
  const double c = std::array{1.0, 0.0, -1.0, 0.0}[arm], s = std::array{0.0, 1.0, 0.0, -1.0}[arm];
  return {kCenterX_m + c * x - s * y, kCenterY_m + s * x + c * y, kGround_m + z};
}

LoggedPoints line(Vector3d a, Vector3d b, double spacing_m = kSpacing_m) {
  const int pieces = std::max(1, static_cast<int>(std::round((b - a).norm() / spacing_m)));
  LoggedPoints points;
  for (int i = 0; i <= pieces; ++i) points.push_back(a + (b - a) * (static_cast<double>(i) / pieces));
  return points;
}

/// Ids of the four arms' features. Arm k has its approach from direction k.
int64_t approach_id(int arm) { return 100 + arm; }
int64_t exit_id(int arm) { return 110 + arm; }
int64_t straight_id(int arm) { return 120 + arm; }
int64_t right_id(int arm) { return 130 + arm; }
int64_t edge_id(int arm) { return 200 + arm; }
int64_t middle_id(int arm) { return 210 + arm; }

void add_roads(const FixtureOptions& options, LoggedScene* scene) {
  const double far_m = kArm_m + kSpacing_m * (options.lane_points - 1);
  const int32_t last = options.lane_points - 1;
  for (int arm = 0; arm < 4; ++arm) {
    // Traffic drives on the right: at arm 0 (east) it enters along y = +1.75 towards -x.
    LoggedLane in{.id = approach_id(arm), .type = LoggedLaneType::surface, .speed_limit_mps = 25 * 0.44704};
    in.points = line(place(far_m, kHalfLane_m, arm), place(kArm_m, kHalfLane_m, arm));
    in.exits = {straight_id(arm), right_id(arm)};
    in.left_boundaries = {{0, last, middle_id(arm)}};
    in.right_boundaries = {{0, last, edge_id((arm + 0) % 4)}};
    LoggedLane out{.id = exit_id(arm), .type = LoggedLaneType::surface, .speed_limit_mps = 0};
    out.points = line(place(kArm_m, -kHalfLane_m, arm), place(far_m, -kHalfLane_m, arm));
    out.entries = {straight_id((arm + 2) % 4), right_id((arm + 3) % 4)};
    out.left_boundaries = {{0, last, middle_id(arm)}};
    LoggedLane straight{.id = straight_id(arm), .type = LoggedLaneType::undefined, .interpolating = true};
    straight.points = line(place(kArm_m, kHalfLane_m, arm), place(-kArm_m, kHalfLane_m, arm));
    straight.entries = {approach_id(arm)};
    straight.exits = {exit_id((arm + 2) % 4)};
    // The right turn of arm 0: towards +y, out of arm 1.
    LoggedLane right{.id = right_id(arm), .type = LoggedLaneType::surface, .interpolating = true};
    const double radius_m = kArm_m - kHalfLane_m;
    for (int i = 0; i <= 40; ++i) {
      const double angle = -0.5 * kPi64 - 0.5 * kPi64 * i / 40;
      right.points.push_back(place(kArm_m + radius_m * std::cos(angle), kArm_m + radius_m * std::sin(angle), arm));
    }
    right.entries = {approach_id(arm)};
    right.exits = {exit_id((arm + 1) % 4)};
    // Shared ends of neighbouring arms are bitwise identical.
    right.points.front() = in.points.back();
    straight.points.front() = in.points.back();
    scene->lanes.insert(scene->lanes.end(), {in, out, straight, right});

    // The kerb between this arm and the next; the road is on its left. It passes the corner on a quarter circle.
    LoggedEdge edge{.id = edge_id(arm)};
    const double kerb_m = 2 * kHalfLane_m, corner_m = kArm_m - kerb_m;
    edge.points = line(place(far_m, kerb_m, arm), place(kArm_m, kerb_m, arm));
    for (int i = 1; i < 16; ++i) {
      const double angle = -0.5 * kPi64 - 0.5 * kPi64 * i / 16;
      edge.points.push_back(place(kArm_m + corner_m * std::cos(angle), kArm_m + corner_m * std::sin(angle), arm));
    }
    const LoggedPoints rest = line(place(kerb_m, kArm_m, arm), place(kerb_m, far_m, arm));
    edge.points.insert(edge.points.end(), rest.begin(), rest.end());
    scene->edges.push_back(edge);

    LoggedLine middle{.id = middle_id(arm), .type = LoggedLineType::solid_double_yellow};
    if (arm == 1) middle.type = LoggedLineType::broken_single_yellow;
    if (arm == 2) middle.type = LoggedLineType::passing_double_yellow;
    middle.points = line(place(kArm_m, 0, arm), place(far_m, 0, arm));
    scene->lines.push_back(middle);
  }
  // Exits begin where the lanes through the junction end.
  for (LoggedLane& lane : scene->lanes) {
    if (!lane.interpolating) continue;
    for (const LoggedLane& next : scene->lanes) {
      if (next.id == lane.exits[0]) lane.points.back() = next.points.front();
    }
  }
  scene->crosswalks.push_back({.id = 300,
                               .points = {place(kArm_m + 1, -3.5, 0), place(kArm_m + 4, -3.5, 0),
                                          place(kArm_m + 4, 3.5, 0), place(kArm_m + 1, 3.5, 0)}});
  scene->stop_signs.push_back(
      {.id = 301, .lanes = {approach_id(1), approach_id(3)}, .position_m = place(kArm_m + 1, 4.5, 1)});
}

void add_lights(LoggedScene* scene) {
  // Formats list lights in the order of lane ids.
  for (const int64_t lane : {straight_id(0), straight_id(2), right_id(0), right_id(2)}) {
    LoggedLight light{.lanes = {lane}};
    for (int step = 0; step < scene->num_steps; ++step) {
      light.states.push_back(step < 3                      ? RecordedLightState::none
                             : step < scene->num_steps / 2 ? RecordedLightState::stop
                             : lane == right_id(0)         ? RecordedLightState::arrow_go
                                                           : RecordedLightState::go);
    }
    scene->lights.push_back(light);
  }
}

void add_tracks(const FixtureOptions& options, LoggedScene* scene) {
  std::mt19937_64 random(options.seed);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
  };
  const int count = options.num_vehicles + options.num_pedestrians + options.num_cyclists;
  // On long lanes all agents start at distinct places.
  constexpr double kApart_m = 8;
  const int places = std::max(4, static_cast<int>(kSpacing_m * (options.lane_points - 1) / kApart_m) - 1);
  for (int i = 0; i < count; ++i) {
    LoggedTrack track{.id = 1000 + 7 * i, .type = TrackType::vehicle, .control = RecordedControl::controllable};
    double length_m = uniform(4, 5.5), width_m = uniform(1.8, 2.1), height_m = uniform(1.4, 1.8), speed_mps = 0;
    if (i >= options.num_vehicles) {
      const bool is_cyclist = i >= options.num_vehicles + options.num_pedestrians;
      track.type = is_cyclist ? TrackType::cyclist : TrackType::pedestrian;
      length_m = is_cyclist ? 1.75 : 0.75;
      width_m = 0.625;
      speed_mps = is_cyclist ? 4 : 1.25;
    } else if (i % 2 == 0) {
      speed_mps = uniform(3, 6);
    } else {
      track.control = RecordedControl::expert;
    }
    const int arm = i % 4;
    const double start_m = kArm_m + 4 + kApart_m * (i / 4 % places),
                 side_m = track.type == TrackType::pedestrian ? 6 : kHalfLane_m;
    for (int step = 0; step < options.num_steps; ++step) {
      LoggedState state;
      // The last track has gaps; invalid states still have a centre.
      state.valid = i + 1 < count || options.num_steps <= 5 || (step > 4 && step % 30 < 25);
      const double x = start_m - speed_mps * 0.1 * step;
      state.center_m = place(x, side_m, arm, 0.5 * height_m);
      if (!state.valid) {
        state.center_m.x() = state.center_m.y() = 0;
        track.states.push_back(state);
        continue;
      }
      state.heading_rad = static_cast<float>(std::remainder(kPi64 + 0.5 * kPi64 * arm, 2 * kPi64));
      state.velocity_x_mps = static_cast<float>(speed_mps * std::cos(state.heading_rad));
      state.velocity_y_mps = static_cast<float>(speed_mps * std::sin(state.heading_rad));
      state.length_m = static_cast<float>(length_m);
      state.width_m = static_cast<float>(width_m);
      state.height_m = static_cast<float>(height_m);
      track.states.push_back(state);
    }
    scene->tracks.push_back(track);
  }
  scene->sdc_track = 0;
  scene->objects_of_interest = {scene->tracks[0].id, scene->tracks.back().id};
  scene->predictions = {{0, 1}, {2, 0}};
}

// WOMD ---------------------------------------------------------------------------------------------------------------

/// A protobuf message whose fields are written at the end, in the style's order.
class Message {
 public:
  explicit Message(const WomdStyle& style) : style_(style) {}

  void varint(int field, int64_t value) { fields_.push_back({field, tag(field, 0) + varint_of(value)}); }
  void number64(int field, double value) { fields_.push_back({field, tag(field, 1) + bytes_of(value)}); }
  void number32(int field, float value) { fields_.push_back({field, tag(field, 5) + bytes_of(value)}); }
  void bytes(int field, const std::string& value) {
    fields_.push_back({field, tag(field, 2) + varint_of(static_cast<int64_t>(value.size())) + value});
  }
  void integers(int field, const std::vector<int64_t>& values, bool packed) {
    if (!packed) {
      for (const int64_t value : values) varint(field, value);
    } else if (!values.empty()) {
      std::string joined;
      for (const int64_t value : values) joined += varint_of(value);
      bytes(field, joined);
    }
  }

  std::string text() {
    if (style_.unknown_fields) {
      varint(1000, -1);
      number64(1001, 0.1);
      bytes(1002, "unknown");
      number32(1003, 0.1f);
    }
    // Elements of a repeated field keep their order.
    std::stable_sort(fields_.begin(), fields_.end(), [&](const Field& a, const Field& b) {
      return style_.descending_fields ? a.number > b.number : a.number < b.number;
    });
    std::string text;
    for (const Field& field : fields_) text += field.bytes;
    return text;
  }

 private:
  struct Field {
    int number;
    std::string bytes;
  };

  static std::string varint_of(int64_t value) {
    auto rest = static_cast<uint64_t>(value);
    std::string text;
    for (; rest >= 0x80; rest >>= 7) text += static_cast<char>((rest & 0x7F) | 0x80);
    return text += static_cast<char>(rest);
  }
  static std::string tag(int field, int type) { return varint_of(int64_t{field} << 3 | type); }
  template <typename T>
  static std::string bytes_of(T value) {
    std::string text(sizeof value, '\0');
    std::memcpy(text.data(), &value, sizeof value);
    return text;
  }

  WomdStyle style_;
  std::vector<Field> fields_;
};

/// Writes the scene's fields through a visitor that gets both their names and numbers: one description for the binary
/// message and for protobuf's JSON.
struct Visitor {
  std::function<void(int, const char*, int64_t)> integer;
  std::function<void(int, const char*, double)> number64;
  std::function<void(int, const char*, float)> number32;
  std::function<void(int, const char*, bool)> boolean;
  std::function<void(int, const char*, const std::string&)> text;
  std::function<void(int, const char*, const std::vector<double>&)> numbers;
  std::function<void(int, const char*, const std::vector<int64_t>&, bool)> integers;  // packed by the schema?
  std::function<void(int, const char*, std::size_t, const std::function<void(Visitor&, std::size_t)>&)> messages;
  std::function<void(int, const char*, const std::function<void(Visitor&)>&)> message;
};

void visit_point(Visitor& to, const Vector3d& p) {
  to.number64(1, "x", p.x());
  to.number64(2, "y", p.y());
  to.number64(3, "z", p.z());
}

void visit_points(Visitor& to, int field, const char* name, const LoggedPoints& points) {
  to.messages(field, name, points.size(), [&](Visitor& inner, std::size_t i) { visit_point(inner, points[i]); });
}

void visit_lane(Visitor& to, const LoggedLane& lane) {
  to.number64(1, "speedLimitMph", lane.speed_limit_mps / 0.44704);
  to.integer(2, "type", static_cast<int64_t>(lane.type));
  to.boolean(3, "interpolating", lane.interpolating);
  visit_points(to, 8, "polyline", lane.points);
  to.integers(9, "entryLanes", lane.entries, true);
  to.integers(10, "exitLanes", lane.exits, true);
  const auto neighbors = [&](int field, const char* name, const std::vector<LoggedNeighbor>& list) {
    to.messages(field, name, list.size(), [&](Visitor& inner, std::size_t i) {
      inner.integer(1, "featureId", list[i].lane);
      inner.integer(2, "selfStartIndex", list[i].begin);
      inner.integer(3, "selfEndIndex", list[i].end);
    });
  };
  neighbors(11, "leftNeighbors", lane.left_neighbors);
  neighbors(12, "rightNeighbors", lane.right_neighbors);
  const auto boundaries = [&](int field, const char* name, const std::vector<LoggedBoundary>& list) {
    to.messages(field, name, list.size(), [&](Visitor& inner, std::size_t i) {
      inner.integer(1, "laneStartIndex", list[i].begin);
      inner.integer(2, "laneEndIndex", list[i].end);
      inner.integer(3, "boundaryFeatureId", list[i].feature);
    });
  };
  boundaries(13, "leftBoundaries", lane.left_boundaries);
  boundaries(14, "rightBoundaries", lane.right_boundaries);
}

void visit_state(Visitor& to, const LoggedState& state) {
  to.number64(4, "centerZ", state.center_m.z());
  to.boolean(11, "valid", state.valid);
  if (!state.valid) return;
  to.number64(2, "centerX", state.center_m.x());
  to.number64(3, "centerY", state.center_m.y());
  to.number32(5, "length", static_cast<float>(state.length_m));
  to.number32(6, "width", static_cast<float>(state.width_m));
  to.number32(7, "height", static_cast<float>(state.height_m));
  to.number32(8, "heading", static_cast<float>(state.heading_rad));
  to.number32(9, "velocityX", static_cast<float>(state.velocity_x_mps));
  to.number32(10, "velocityY", static_cast<float>(state.velocity_y_mps));
}

void visit_features(Visitor& to, const LoggedScene& scene) {
  constexpr const char* kName = "mapFeatures";
  const auto feature = [&](std::size_t count, auto&& id_of, int field, const char* name, auto&& visit) {
    to.messages(8, kName, count, [&](Visitor& inner, std::size_t i) {
      inner.integer(1, "id", id_of(i));
      inner.message(field, name, [&](Visitor& part) { visit(part, i); });
    });
  };
  feature(
      scene.lanes.size(), [&](std::size_t i) { return scene.lanes[i].id; }, 3, "lane",
      [&](Visitor& part, std::size_t i) { visit_lane(part, scene.lanes[i]); });
  feature(
      scene.lines.size(), [&](std::size_t i) { return scene.lines[i].id; }, 4, "roadLine",
      [&](Visitor& part, std::size_t i) {
        part.integer(1, "type", static_cast<int64_t>(scene.lines[i].type));
        visit_points(part, 2, "polyline", scene.lines[i].points);
      });
  feature(
      scene.edges.size(), [&](std::size_t i) { return scene.edges[i].id; }, 5, "roadEdge",
      [&](Visitor& part, std::size_t i) {
        part.integer(1, "type", 1);
        visit_points(part, 2, "polyline", scene.edges[i].points);
      });
  feature(
      scene.stop_signs.size(), [&](std::size_t i) { return scene.stop_signs[i].id; }, 7, "stopSign",
      [&](Visitor& part, std::size_t i) {
        part.integers(1, "lane", scene.stop_signs[i].lanes, false);
        part.message(2, "position", [&](Visitor& point) { visit_point(point, scene.stop_signs[i].position_m); });
      });
  feature(
      scene.crosswalks.size(), [&](std::size_t i) { return scene.crosswalks[i].id; }, 8, "crosswalk",
      [&](Visitor& part, std::size_t i) { visit_points(part, 1, "polygon", scene.crosswalks[i].points); });
}

void visit_scene(Visitor& to, const LoggedScene& scene) {
  const auto steps = static_cast<std::size_t>(scene.num_steps);
  std::vector<double> times;
  for (std::size_t step = 0; step < steps; ++step) times.push_back(scene.dt_s * static_cast<double>(step));
  to.numbers(1, "timestampsSeconds", times);
  to.messages(2, "tracks", scene.tracks.size(), [&](Visitor& track, std::size_t i) {
    track.integer(1, "id", scene.tracks[i].id);
    track.integer(2, "objectType", static_cast<int64_t>(scene.tracks[i].type));
    track.messages(3, "states", steps,
                   [&](Visitor& state, std::size_t step) { visit_state(state, scene.tracks[i].states[step]); });
  });
  to.integers(4, "objectsOfInterest", scene.objects_of_interest, false);
  to.text(5, "scenarioId", scene.id);
  to.integer(6, "sdcTrackIndex", scene.sdc_track);
  if (!scene.lights.empty()) {
    std::map<int64_t, Vector3d> starts;
    for (const LoggedLane& lane : scene.lanes) starts[lane.id] = lane.points.front();
    to.messages(7, "dynamicMapStates", steps, [&](Visitor& step_states, std::size_t step) {
      step_states.messages(1, "laneStates", scene.lights.size(), [&](Visitor& state, std::size_t i) {
        state.integer(1, "lane", scene.lights[i].lanes[0]);
        state.integer(2, "state", static_cast<int64_t>(scene.lights[i].states[step]));
        state.message(3, "stopPoint", [&](Visitor& point) { visit_point(point, starts[scene.lights[i].lanes[0]]); });
      });
    });
  }
  visit_features(to, scene);
  to.integer(10, "currentTimeIndex", scene.current_step);
  to.messages(11, "tracksToPredict", scene.predictions.size(), [&](Visitor& prediction, std::size_t i) {
    prediction.integer(1, "trackIndex", scene.predictions[i].first);
    prediction.integer(2, "difficulty", scene.predictions[i].second);
  });
}

Visitor binary_visitor(Message* message, const WomdStyle& style) {
  Visitor to;
  to.integer = [=](int field, const char*, int64_t value) { message->varint(field, value); };
  to.number64 = [=](int field, const char*, double value) { message->number64(field, value); };
  to.number32 = [=](int field, const char*, float value) { message->number32(field, value); };
  to.boolean = [=](int field, const char*, bool value) { message->varint(field, value ? 1 : 0); };
  to.text = [=](int field, const char*, const std::string& value) { message->bytes(field, value); };
  to.numbers = [=](int field, const char*, const std::vector<double>& values) {
    if (!style.packed) {
      for (const double value : values) message->number64(field, value);
      return;
    }
    message->bytes(field, {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(double)});
  };
  to.integers = [=](int field, const char*, const std::vector<int64_t>& values, bool packed) {
    message->integers(field, values, packed || style.packed);
  };
  to.message = [=](int field, const char*, const std::function<void(Visitor&)>& visit) {
    Message inner(style);
    Visitor inside = binary_visitor(&inner, style);
    visit(inside);
    message->bytes(field, inner.text());
  };
  to.messages = [=](int field, const char*, std::size_t count,
                    const std::function<void(Visitor&, std::size_t)>& visit) {
    for (std::size_t i = 0; i < count; ++i) {
      Message inner(style);
      Visitor inside = binary_visitor(&inner, style);
      visit(inside, i);
      message->bytes(field, inner.text());
    }
  };
  return to;
}

std::string joined(const std::vector<std::string>& parts, const char* around) {
  return fmt::format("{}{}{}", around[0], fmt::join(parts, ","), around[1]);
}

/// Returns a number as JSON text. A whole number keeps its point, because -0 would lose its sign without it.
template <typename T>
std::string number_text(T value, const char* format) {
  std::string text = fmt::format(fmt::runtime(format), value);
  if (text.find_first_of(".e") == std::string::npos) text += ".0";
  return text;
}

/// Repeated messages of one name are collected, because features come in several lists.
struct JsonObject {
  std::vector<std::string> members;
  std::map<std::string, std::vector<std::string>> lists;
  std::string text() const {
    std::vector<std::string> all = members;
    for (const auto& [name, items] : lists) all.push_back(fmt::format("\"{}\":{}", name, joined(items, "[]")));
    return joined(all, "{}");
  }
};

Visitor json_visitor(JsonObject* object) {
  Visitor to;
  const auto add = [=](const char* name, const std::string& value) {
    object->members.push_back(fmt::format("\"{}\":{}", name, value));
  };
  to.integer = [=](int, const char* name, int64_t value) { add(name, fmt::format("{}", value)); };
  to.number64 = [=](int, const char* name, double value) { add(name, number_text(value, "{:.17g}")); };
  to.number32 = [=](int, const char* name, float value) { add(name, number_text(value, "{:.9g}")); };
  to.boolean = [=](int, const char* name, bool value) { add(name, value ? "true" : "false"); };
  to.text = [=](int, const char* name, const std::string& value) { add(name, fmt::format("\"{}\"", value)); };
  to.numbers = [=](int, const char* name, const std::vector<double>& values) {
    std::vector<std::string> items;
    for (const double value : values) items.push_back(fmt::format("{:.17g}", value));
    add(name, joined(items, "[]"));
  };
  to.integers = [=](int, const char* name, const std::vector<int64_t>& values, bool) {
    add(name, fmt::format("[{}]", fmt::join(values, ",")));
  };
  to.message = [=](int, const char* name, const std::function<void(Visitor&)>& visit) {
    JsonObject inner;
    Visitor inside = json_visitor(&inner);
    visit(inside);
    add(name, inner.text());
  };
  to.messages = [=](int, const char* name, std::size_t count, const std::function<void(Visitor&, std::size_t)>& visit) {
    for (std::size_t i = 0; i < count; ++i) {
      JsonObject inner;
      Visitor inside = json_visitor(&inner);
      visit(inside, i);
      object->lists[name].push_back(inner.text());
    }
  };
  return to;
}

// PufferDrive --------------------------------------------------------------------------------------------------------

class Bytes {
 public:
  void integer(int64_t value) { put(static_cast<int32_t>(value)); }
  void number(double value) { put(static_cast<float>(value)); }
  void text(const std::string& value, std::size_t size) {
    std::string padded = value.substr(0, size);
    padded.resize(size);
    bytes_ += padded;
  }
  std::string take() { return std::move(bytes_); }

 private:
  template <typename T>
  void put(T value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  std::string bytes_;
};

template <typename Of>
void channel(Bytes* out, const LoggedTrack& track, Of&& of) {
  for (const LoggedState& state : track.states) out->number(state.valid ? of(state) : -10000.0);
}

void axis(Bytes* out, const LoggedPoints& points, int index) {
  for (const Vector3d& p : points) out->number(p[index]);
}

const LoggedState& last_valid(const LoggedTrack& track) {
  const LoggedState* last = nullptr;
  for (const LoggedState& state : track.states) last = state.valid ? &state : last;
  return *last;
}

void old_agent(Bytes* out, const LoggedTrack& track, bool has_ids) {
  if (has_ids) out->integer(7);
  out->integer(static_cast<int>(track.type));
  if (has_ids) out->integer(track.id);
  out->integer(static_cast<int64_t>(track.states.size()));
  channel(out, track, [](const LoggedState& s) { return s.center_m.x(); });
  channel(out, track, [](const LoggedState& s) { return s.center_m.y(); });
  channel(out, track, [](const LoggedState& s) { return s.center_m.z(); });
  channel(out, track, [](const LoggedState& s) { return s.velocity_x_mps; });
  channel(out, track, [](const LoggedState& s) { return s.velocity_y_mps; });
  channel(out, track, [](const LoggedState&) { return 0.0; });
  channel(out, track, [](const LoggedState& s) { return s.heading_rad; });
  for (const LoggedState& state : track.states) out->integer(state.valid);
  const LoggedState& last = last_valid(track);
  for (const double value :
       {last.width_m, last.length_m, last.height_m, last.center_m.x(), last.center_m.y(), last.center_m.z()}) {
    out->number(value);
  }
  out->integer(track.control == RecordedControl::expert);
}

void old_road(Bytes* out, int type, int64_t id, const LoggedPoints& points, bool has_ids) {
  if (has_ids) out->integer(7);
  out->integer(type);
  if (has_ids) out->integer(id);
  out->integer(static_cast<int64_t>(points.size()));
  for (int i = 0; i < 3; ++i) axis(out, points, i);
  for (int i = 0; i < 6; ++i) out->number(0);
  out->integer(0);
}

std::string write_old(const LoggedScene& scene, bool has_ids, bool has_name) {
  Bytes out;
  if (has_name) out.text(scene.id, 16);
  if (has_ids) {
    out.integer(scene.sdc_track);
    out.integer(static_cast<int64_t>(scene.predictions.size()));
    for (const auto& [track, difficulty] : scene.predictions) out.integer(track);
  }
  out.integer(static_cast<int64_t>(scene.tracks.size()));
  out.integer(static_cast<int64_t>(scene.lanes.size() + scene.lines.size() + scene.edges.size() +
                                   scene.crosswalks.size() + scene.stop_signs.size()));
  for (const LoggedTrack& track : scene.tracks) old_agent(&out, track, has_ids);
  for (const LoggedLane& lane : scene.lanes) old_road(&out, 4, lane.id, lane.points, has_ids);
  for (const LoggedLine& each : scene.lines) old_road(&out, 5, each.id, each.points, has_ids);
  for (const LoggedEdge& edge : scene.edges) old_road(&out, 6, edge.id, edge.points, has_ids);
  for (const LoggedStopSign& sign : scene.stop_signs) old_road(&out, 7, sign.id, {sign.position_m}, has_ids);
  for (const LoggedPolygon& polygon : scene.crosswalks) old_road(&out, 8, polygon.id, polygon.points, has_ids);
  return out.take();
}

std::string write_new(const LoggedScene& scene) {
  Bytes out;
  // Ids are positions in the file.
  std::map<int64_t, int64_t> lane_index;
  for (std::size_t i = 0; i < scene.lanes.size(); ++i) lane_index[scene.lanes[i].id] = static_cast<int64_t>(i);
  const auto roads = scene.lanes.size() + scene.lines.size() + scene.edges.size() + scene.crosswalks.size();
  out.integer(static_cast<int64_t>(scene.tracks.size()));
  out.integer(static_cast<int64_t>(roads));
  out.integer(static_cast<int64_t>(scene.lights.size() + scene.stop_signs.size()));
  out.integer(0);
  for (std::size_t i = 0; i < scene.tracks.size(); ++i) {
    const LoggedTrack& track = scene.tracks[i];
    out.integer(static_cast<int64_t>(i));
    out.integer(track.type == TrackType::other ? 0 : static_cast<int>(track.type));
    out.integer(scene.num_steps);
    channel(&out, track, [](const LoggedState& s) { return s.center_m.x(); });
    channel(&out, track, [](const LoggedState& s) { return s.center_m.y(); });
    channel(&out, track, [](const LoggedState& s) { return s.center_m.z(); });
    channel(&out, track, [](const LoggedState& s) { return s.heading_rad; });
    channel(&out, track, [](const LoggedState& s) { return s.velocity_x_mps; });
    channel(&out, track, [](const LoggedState& s) { return s.velocity_y_mps; });
    channel(&out, track, [](const LoggedState& s) { return s.length_m; });
    channel(&out, track, [](const LoggedState& s) { return s.width_m; });
    channel(&out, track, [](const LoggedState& s) { return s.height_m; });
    for (const LoggedState& state : track.states) out.integer(state.valid);
    out.integer(1);
    out.integer(0);
    out.integer(1);
    const LoggedState& last = last_valid(track);
    for (int k = 0; k < 3; ++k) out.number(last.center_m[k]);
    out.integer(track.control == RecordedControl::expert ? 1 : 0);
  }
  int64_t index = 0;
  const auto road = [&](int type, const LoggedPoints& points) {
    out.integer(index++);
    out.integer(type);
    out.integer(static_cast<int64_t>(points.size()));
    for (int k = 0; k < 3; ++k) axis(&out, points, k);
    for (std::size_t k = 0; k < points.size(); ++k) out.number(0);
  };
  for (const LoggedLane& lane : scene.lanes) {
    road(static_cast<int>(lane.type), lane.points);
    for (const auto* links : {&lane.entries, &lane.exits}) {
      out.integer(static_cast<int64_t>(links->size()));
      for (const int64_t id : *links) out.integer(lane_index.at(id));
    }
    out.number(lane.speed_limit_mps > 0 ? lane.speed_limit_mps : -1);
    out.number(1);
    for (std::size_t k = 0; k < lane.points.size(); ++k) out.number(static_cast<double>(k));
  }
  for (const LoggedLine& each : scene.lines) road(10 + static_cast<int>(each.type), each.points);
  for (const LoggedEdge& edge : scene.edges) road(21, edge.points);
  for (const LoggedPolygon& polygon : scene.crosswalks) road(31, polygon.points);
  int64_t control = 0;
  const auto head = [&](int type, const Vector3d& a, const Vector3d& b) {
    out.integer(control++);
    out.integer(type);
    for (const Vector3d& p : {a, b}) {
      for (int k = 0; k < 3; ++k) out.number(p[k]);
    }
    out.number(0);
  };
  for (const LoggedLight& light : scene.lights) {
    const LoggedLane& lane = scene.lanes[lane_index.at(light.lanes[0])];
    const Vector3d way = (lane.points[1] - lane.points[0]).normalized();
    const Vector3d left(-way.y() * kHalfLane_m, way.x() * kHalfLane_m, 0);
    head(1, lane.points[0] + left, lane.points[0] - left);
    out.integer(static_cast<int64_t>(light.states.size()));
    for (const RecordedLightState state : light.states) {
      const bool is_stop = state == RecordedLightState::stop, is_none = state == RecordedLightState::none;
      out.integer(is_none ? 0 : is_stop ? 1 : 3);
    }
    out.integer(1);
    out.integer(lane_index.at(light.lanes[0]));
  }
  for (const LoggedStopSign& sign : scene.stop_signs) {
    head(2, sign.position_m, sign.position_m);
    out.integer(0);
    out.integer(static_cast<int64_t>(sign.lanes.size()));
    for (const int64_t id : sign.lanes) out.integer(lane_index.at(id));
  }
  out.integer(1);
  out.integer(0);
  out.number(std::numeric_limits<double>::infinity());
  out.text(scene.id, 128);
  out.text("synthetic", 32);
  out.integer(scene.num_steps);
  out.number(scene.dt_s);
  out.integer(0);
  out.integer(static_cast<int64_t>(scene.predictions.size()));
  for (const auto& [track, difficulty] : scene.predictions) out.integer(track);
  return out.take();
}

}  // namespace

LoggedScene make_fixture(const FixtureOptions& options) {
  LoggedScene scene;
  scene.id = fmt::format("fixture{:08x}", options.seed);
  scene.source = scene.name = scene.id;
  scene.format = "womd";
  scene.num_steps = options.num_steps;
  scene.current_step = std::min(10, options.num_steps - 1);
  add_roads(options, &scene);
  if (options.has_lights) add_lights(&scene);
  add_tracks(options, &scene);
  return scene;
}

std::string write_womd(const LoggedScene& scene, const WomdStyle& style) {
  Message message(style);
  Visitor to = binary_visitor(&message, style);
  visit_scene(to, scene);
  return message.text();
}

std::string write_womd_json(const LoggedScene& scene) {
  JsonObject object;
  Visitor to = json_visitor(&object);
  visit_scene(to, scene);
  return object.text();
}

std::string write_tfrecord(const std::vector<std::string>& records) {
  std::string file;
  for (const std::string& record : records) {
    const uint64_t size = record.size();
    const std::string length(reinterpret_cast<const char*>(&size), sizeof size);
    const auto sum = [](std::string_view bytes) {
      const uint32_t crc = masked_crc32c(bytes);
      return std::string(reinterpret_cast<const char*>(&crc), sizeof crc);
    };
    file += length + sum(length) + record + sum(record);
  }
  return file;
}

std::string write_gpudrive(const LoggedScene& scene) {
  const auto point = [](const Vector3d& p) {
    return fmt::format("{{\"x\":{:.17g},\"y\":{:.17g},\"z\":{:.17g}}}", p.x(), p.y(), p.z());
  };
  std::vector<std::string> objects, roads, lights, predictions;
  for (const LoggedTrack& track : scene.tracks) {
    const LoggedState& last = last_valid(track);
    std::vector<std::string> position, heading, velocity, valid;
    for (const LoggedState& s : track.states) {
      const bool is = s.valid;
      position.push_back(point(is ? s.center_m : Vector3d(-10000, -10000, -10000)));
      heading.push_back(fmt::format("{:.17g}", is ? s.heading_rad : -10000.0));
      velocity.push_back(fmt::format("{{\"x\":{:.17g},\"y\":{:.17g}}}", is ? s.velocity_x_mps : -10000.0,
                                     is ? s.velocity_y_mps : -10000.0));
      valid.push_back(is ? "true" : "false");
    }
    objects.push_back(fmt::format(
        "{{\"position\":{},\"width\":{:.17g},\"length\":{:.17g},\"height\":{:.17g},\"id\":{},\"heading\":{},"
        "\"velocity\":{},\"valid\":{},\"goalPosition\":{},\"type\":\"{}\",\"mark_as_expert\":{}}}",
        joined(position, "[]"), last.width_m, last.length_m, last.height_m, track.id, joined(heading, "[]"),
        joined(velocity, "[]"), joined(valid, "[]"), point(last.center_m), to_string(track.type),
        track.control == RecordedControl::expert));
  }
  const auto road = [&](int64_t id, const char* type, int element, const LoggedPoints& points) {
    std::vector<std::string> geometry;
    for (const Vector3d& p : points) geometry.push_back(point(p));
    roads.push_back(fmt::format("{{\"geometry\":{},\"type\":\"{}\",\"map_element_id\":{},\"id\":{}}}",
                                joined(geometry, "[]"), type, element, id));
  };
  for (const LoggedLane& lane : scene.lanes) road(lane.id, "lane", static_cast<int>(lane.type), lane.points);
  for (const LoggedLine& each : scene.lines) road(each.id, "road_line", 5 + static_cast<int>(each.type), each.points);
  for (const LoggedEdge& edge : scene.edges) road(edge.id, "road_edge", 15, edge.points);
  for (const LoggedStopSign& sign : scene.stop_signs) road(sign.id, "stop_sign", 17, {sign.position_m});
  for (const LoggedPolygon& polygon : scene.crosswalks) road(polygon.id, "crosswalk", 18, polygon.points);
  for (const LoggedLight& light : scene.lights) {
    std::vector<std::string> states, times;
    for (std::size_t step = 0; step < light.states.size(); ++step) {
      const RecordedLightState state = light.states[step];
      states.push_back(fmt::format("\"{}\"", state == RecordedLightState::none ? "unknown" : to_string(state)));
      times.push_back(std::to_string(step));
    }
    lights.push_back(fmt::format("\"{}\":{{\"state\":{},\"time_index\":{}}}", light.lanes[0], joined(states, "[]"),
                                 joined(times, "[]")));
  }
  for (const auto& [track, difficulty] : scene.predictions) {
    predictions.push_back(fmt::format("{{\"track_index\":{},\"difficulty\":{}}}", track, difficulty));
  }
  return fmt::format(
      "{{\"name\":\"fixture\",\"scenario_id\":\"{}\",\"objects\":{},\"roads\":{},\"tl_states\":{},"
      "\"metadata\":{{\"sdc_track_index\":{},\"objects_of_interest\":[{}],\"tracks_to_predict\":{}}}}}",
      scene.id, joined(objects, "[]"), joined(roads, "[]"), joined(lights, "{}"), scene.sdc_track,
      fmt::join(scene.objects_of_interest, ","), joined(predictions, "[]"));
}

std::string write_pufferdrive(const LoggedScene& scene, PufferLayout layout) {
  if (layout == PufferLayout::v3c) return write_new(scene);
  return write_old(scene, layout != PufferLayout::v1, layout == PufferLayout::v2_with_id);
}

std::string write_pufferdrive_tails(const LoggedScene& scene, float width_m) {
  Bytes tail;
  tail.text("TLPHASE1", 8);
  for (std::size_t i = 0; i < scene.lights.size() + scene.stop_signs.size(); ++i) {
    tail.integer(-1);
    tail.integer(-1);
  }
  tail.text("LANEWID1", 8);
  for (const LoggedLane& lane : scene.lanes) {
    for (std::size_t i = 0; i < lane.points.size(); ++i) tail.number(double{width_m});
  }
  return write_new(scene) + tail.take();
}

}  // namespace pictura::test
