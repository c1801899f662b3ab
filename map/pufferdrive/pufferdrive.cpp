#include "pictura/map/pufferdrive/pufferdrive.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <vector>

#include "pictura/common/error.h"

namespace pictura::pufferdrive {

namespace {

static_assert(std::endian::native == std::endian::little, "the files are little-endian");

// Maximum counts of a scene. If a count is larger, the next layout is tried.
constexpr int32_t kMaxTracks = kMaxScenarioTracks, kMaxRoads = 1'000'000, kMaxPoints = 1'000'000, kMaxLinks = 10'000;
constexpr int32_t kMaxGraphLanes = 30'000;  // the lane graph's matrix has the square of this size
constexpr int32_t kHistorySteps = 10;       // steps of history in WOMD, the source of the files; the files lack them

/// Reads numbers in sequence. Throws FieldError at the end of the bytes.
class Cursor {
 public:
  explicit Cursor(std::string_view bytes) : rest_(bytes) {}

  template <typename T>
  T take(const char* field) {
    T value;
    const std::string_view bytes = take_bytes(field, sizeof value);
    std::memcpy(&value, bytes.data(), sizeof value);
    return value;
  }
  int32_t integer(const char* field) { return take<int32_t>(field); }
  float number(const char* field) { return take<float>(field); }
  int32_t count(const char* field, int32_t most) {
    const int32_t value = integer(field);
    if (value < 0 || value > most) fail_field(field, "expected a number of 0 to {}, got {}", most, value);
    return value;
  }
  template <typename T>
  std::vector<T> array(const char* field, int32_t size) {
    std::vector<T> values(static_cast<std::size_t>(size));
    const std::string_view bytes = take_bytes(field, values.size() * sizeof(T));
    if (size > 0) std::memcpy(values.data(), bytes.data(), bytes.size());
    return values;
  }
  std::string_view take_bytes(const char* field, std::size_t size) {
    if (size > rest_.size()) fail_field(field, "expected {} bytes, got the remaining {}", size, rest_.size());
    const std::string_view bytes = rest_.substr(0, size);
    rest_.remove_prefix(size);
    return bytes;
  }
  void expect_end() const {
    if (!rest_.empty()) fail_field("", "expected the end of the file, got {} more bytes", rest_.size());
  }
  std::string_view rest() const { return rest_; }

 private:
  std::string_view rest_;
};

/// Returns the text of a field that is padded with zero bytes.
std::string text_of(const char* field, std::string_view bytes) {
  std::string text(bytes.substr(0, bytes.find('\0')));
  for (const char letter : text) {
    if (letter < ' ' || letter > '~') fail_field(field, "expected printable letters, got byte {}", int{letter});
  }
  return text;
}

void require_steps(LoggedScene* scene, int32_t steps) {
  if (steps < 1 || steps > kMaxScenarioSteps) {
    fail_field("T", "expected 1 to {} steps, got {}", kMaxScenarioSteps, steps);
  }
  if (scene->num_steps == 0) scene->num_steps = steps;
  if (scene->num_steps != steps) {
    fail_field("T", "expected {} steps, as for the previous agents, got {}", scene->num_steps, steps);
  }
}

void check_state(const LoggedState& state) {
  checked_number("x", state.center_m.x());
  checked_number("y", state.center_m.y());
  checked_number("z", state.center_m.z());
  checked_number("heading", state.heading_rad);
  checked_number("vx", state.velocity_x_mps);
  checked_number("vy", state.velocity_y_mps);
  checked_number("length", state.length_m);
  checked_number("width", state.width_m);
  checked_number("height", state.height_m);
}

LoggedPoints read_points(Cursor* cursor, int32_t count) {
  const std::vector<float> x = cursor->array<float>("x", count), y = cursor->array<float>("y", count),
                           z = cursor->array<float>("z", count);
  LoggedPoints points;
  for (std::size_t i = 0; i < x.size(); ++i) {
    points.emplace_back(checked_number("x", double{x[i]}), checked_number("y", double{y[i]}),
                        checked_number("z", double{z[i]}));
  }
  return points;
}

/// Adds an edge or a polygon to the scene.
void add_feature(LoggedScene* scene, int32_t id, LoggedPoints points, bool is_edge) {
  if (is_edge) {
    scene->edges.push_back({.id = id, .points = std::move(points)});
  } else {
    scene->crosswalks.push_back({.id = id, .points = std::move(points)});
  }
}

// v1 and v2 ----------------------------------------------------------------------------------------------------------

/// Converts a type: vehicles, pedestrians and cyclists are 1 to 3 in all layouts.
TrackType track_type(int32_t type) {
  if (type < 1 || type > 3) fail_field("type", "expected 1 (vehicle), 2 (pedestrian) or 3 (cyclist), got {}", type);
  return static_cast<TrackType>(type);
}

void read_old_agent(Cursor* cursor, bool has_ids, int32_t index, LoggedScene* scene) {
  LoggedTrack& track = scene->tracks.emplace_back();
  track.id = index;
  if (has_ids) cursor->integer("scenario_id");
  track.type = track_type(cursor->integer("type"));
  if (has_ids) track.id = cursor->integer("id");
  const int32_t steps = cursor->integer("T");
  require_steps(scene, steps);
  const std::vector<float> x = cursor->array<float>("x", steps), y = cursor->array<float>("y", steps),
                           z = cursor->array<float>("z", steps), vx = cursor->array<float>("vx", steps),
                           vy = cursor->array<float>("vy", steps);
  cursor->array<float>("vz", steps);
  const std::vector<float> heading = cursor->array<float>("heading", steps);
  const std::vector<int32_t> valid = cursor->array<int32_t>("valid", steps);
  const float width = cursor->number("width"), length = cursor->number("length"), height = cursor->number("height");
  for (const char* field : {"goal_x", "goal_y", "goal_z"}) cursor->number(field);
  const int32_t expert = cursor->integer("mark_as_expert");
  if (expert != 0 && expert != 1) fail_field("mark_as_expert", "expected 0 or 1, got {}", expert);
  track.control = expert ? RecordedControl::expert : RecordedControl::controllable;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (valid[i] != 0 && valid[i] != 1) fail_field("valid", "expected 0 or 1, got {}", valid[i]);
    LoggedState& state = track.states.emplace_back();
    state.valid = valid[i] != 0;
    if (!state.valid) continue;
    state = {.center_m = {double{x[i]}, double{y[i]}, double{z[i]}},
             .heading_rad = double{heading[i]},
             .velocity_x_mps = double{vx[i]},
             .velocity_y_mps = double{vy[i]},
             .length_m = double{length},
             .width_m = double{width},
             .height_m = double{height},
             .valid = true};
    check_state(state);
  }
}

void read_old_road(Cursor* cursor, bool has_ids, int32_t index, LoggedScene* scene) {
  enum OldRoad { lane = 4, line, edge, stop_sign, crosswalk, speed_bump, driveway };
  if (has_ids) cursor->integer("scenario_id");
  const int32_t type = cursor->integer("type");
  if (type < lane || type > driveway) fail_field("type", "expected 4 to 10, got {}", type);
  if (has_ids) cursor->integer("id");  // not unique in some files; the index is used instead
  const int32_t count = cursor->count("n", kMaxPoints);
  LoggedPoints points = read_points(cursor, count);
  // Skips fields that have a meaning only for agents: width, length, height, goal and mark_as_expert.
  for (int i = 0; i < 6; ++i) cursor->number("width");
  cursor->integer("mark_as_expert");
  switch (type) {
    case lane:
      scene->lanes.push_back({.id = index, .type = LoggedLaneType::surface, .points = std::move(points)});
      break;
    case line: scene->lines.push_back({.id = index, .points = std::move(points)}); break;
    case edge:
    case crosswalk: add_feature(scene, index, std::move(points), type == edge); break;
    case stop_sign:
      if (points.empty()) {
        scene->note("stop signs without a point left out", fmt::format("roads[{}]", index));
      } else {
        scene->stop_signs.push_back({.id = index, .position_m = points[0]});
      }
      break;
    default:
      scene->note("speed bumps and driveways, which maps do not have, left out", fmt::format("roads[{}]", index));
  }
}

void read_old(Cursor* cursor, bool is_v2, bool has_name, LoggedScene* scene) {
  scene->has_links = false;
  if (has_name) {
    constexpr std::size_t kName_bytes = 16;
    scene->id = text_of("scenario_id", cursor->take_bytes("scenario_id", kName_bytes));
  }
  if (is_v2) {
    scene->sdc_track = cursor->integer("sdc_track_index");
    const int32_t predictions = cursor->count("n_tracks_to_predict", kMaxTracks);
    for (int32_t i = 0; i < predictions; ++i) scene->predictions.emplace_back(cursor->integer("tracks_to_predict"), 0);
  }
  const int32_t agents = cursor->count("n_objects", kMaxTracks), roads = cursor->count("n_roads", kMaxRoads);
  for (int32_t i = 0; i < agents; ++i) {
    within("objects", static_cast<std::size_t>(i), [&] { read_old_agent(cursor, is_v2, i, scene); });
  }
  for (int32_t i = 0; i < roads; ++i) {
    within("roads", static_cast<std::size_t>(i), [&] { read_old_road(cursor, is_v2, i, scene); });
  }
  cursor->expect_end();
  // The index refers to the tracks of the recording. The file may lack some of these tracks.
  if (scene->sdc_track >= agents || scene->sdc_track < -1) {
    scene->note("indices of the recording's tracks that are no track of the file left out", "sdc_track_index");
    scene->sdc_track = -1;
  }
  std::erase_if(scene->predictions, [&](const std::pair<int32_t, int32_t>& prediction) {
    const bool is_lost = prediction.first < 0 || prediction.first >= agents;
    if (is_lost) {
      scene->note("indices of the recording's tracks that are no track of the file left out", "tracks_to_predict");
    }
    return is_lost;
  });
}

// v3c ----------------------------------------------------------------------------------------------------------------

void read_agent(Cursor* cursor, int32_t index, bool is_track, LoggedScene* scene) {
  LoggedTrack track;
  track.id = cursor->integer("id");
  const int32_t type = cursor->integer("type");
  const int32_t steps = cursor->integer("T");
  require_steps(scene, steps);
  std::array<std::vector<float>, 9> channels;
  constexpr std::array kNames{"x", "y", "z", "heading", "vx", "vy", "length", "width", "height"};
  for (std::size_t i = 0; i < channels.size(); ++i) channels[i] = cursor->array<float>(kNames[i], steps);
  const std::vector<int32_t> valid = cursor->array<int32_t>("valid", steps);
  if (!is_track) {
    scene->note("objects that are no road users left out", fmt::format("objects[{}]", index));
    return;
  }
  if (track.id != index) fail_field("id", "expected its index {}, got {}", index, track.id);
  track.type = type == 0 ? TrackType::other : track_type(type);
  cursor->array<int32_t>("route", cursor->count("n_route", kMaxLinks));
  cursor->integer("route_gt_len");
  for (const char* field : {"goal_x", "goal_y", "goal_z"}) cursor->number(field);
  const int32_t control = cursor->integer("control_state");
  if (control < 0 || control > 2) fail_field("control_state", "expected 0 to 2, got {}", control);
  track.control = control == 0   ? RecordedControl::controllable
                  : control == 1 ? RecordedControl::expert
                                 : RecordedControl::still;
  for (std::size_t i = 0; i < valid.size(); ++i) {
    if (valid[i] != 0 && valid[i] != 1) fail_field("valid", "expected 0 or 1, got {}", valid[i]);
    LoggedState& state = track.states.emplace_back();
    state.valid = valid[i] != 0;
    if (!state.valid) continue;
    const auto at = [&](std::size_t channel) { return double{channels[channel][i]}; };
    state = {.center_m = {at(0), at(1), at(2)},
             .heading_rad = at(3),
             .velocity_x_mps = at(4),
             .velocity_y_mps = at(5),
             .length_m = at(6),
             .width_m = at(7),
             .height_m = at(8),
             .valid = true};
    check_state(state);
  }
  scene->tracks.push_back(std::move(track));
}

std::vector<int64_t> read_ids(Cursor* cursor, const char* field) {
  const std::vector<int32_t> ids = cursor->array<int32_t>(field, cursor->count(field, kMaxLinks));
  return {ids.begin(), ids.end()};
}

void read_road(Cursor* cursor, int32_t index, LoggedScene* scene) {
  const int32_t id = cursor->integer("id");
  if (id != index) fail_field("id", "expected its index {}, got {}", index, id);
  const int32_t type = cursor->integer("type");
  const int32_t count = cursor->count("n", kMaxPoints);
  LoggedPoints points = read_points(cursor, count);
  cursor->array<float>("heading", count);
  constexpr int32_t kLastLane = 9, kFirstLine = 10, kLastLine = 18, kFirstEdge = 20, kLastEdge = 22, kCrosswalk = 31;
  if (type >= 0 && type <= kLastLane) {
    LoggedLane lane{.id = id, .points = std::move(points)};
    if (type <= static_cast<int32_t>(LoggedLaneType::bus)) lane.type = static_cast<LoggedLaneType>(type);
    lane.entries = read_ids(cursor, "entry_lanes");
    lane.exits = read_ids(cursor, "exit_lanes");
    const double limit_mps = checked_number("speed_limit", double{cursor->number("speed_limit")}, 1000);
    lane.speed_limit_mps = limit_mps > 0 ? limit_mps : 0;
    cursor->number("length");
    cursor->array<float>("cum_length", count);
    scene->lanes.push_back(std::move(lane));
  } else if (type >= kFirstLine && type <= kLastLine) {
    scene->lines.push_back(
        {.id = id, .type = static_cast<LoggedLineType>(type - kFirstLine), .points = std::move(points)});
  } else if ((type >= kFirstEdge && type <= kLastEdge) || type == kCrosswalk) {
    add_feature(scene, id, std::move(points), type != kCrosswalk);
  } else if (type >= 0 && type < 100) {
    scene->note("areas that maps do not have left out", fmt::format("roads[{}]", index));
  } else {
    fail_field("type", "expected 0 to 99, got {}", type);
  }
}

void read_control(Cursor* cursor, int32_t index, LoggedScene* scene) {
  constexpr std::array kStates{RecordedLightState::none, RecordedLightState::stop, RecordedLightState::caution,
                               RecordedLightState::go, RecordedLightState::none};
  const int32_t id = cursor->integer("id");
  if (id != index) fail_field("id", "expected its index {}, got {}", index, id);
  const int32_t type = cursor->integer("type");
  std::array<double, 6> line{};
  for (double& value : line) value = checked_number("stop_line", double{cursor->number("stop_line")});
  checked_number("heading", double{cursor->number("heading")});
  const std::vector<int32_t> states = cursor->array<int32_t>("states", cursor->count("n_states", kMaxScenarioSteps));
  const std::vector<int64_t> lanes = read_ids(cursor, "controlled_lanes");
  constexpr int32_t kLight = 1, kStopSign = 2, kYieldSign = 3;
  if (type < kLight || type > kYieldSign) fail_field("type", "expected 1 to 3, got {}", type);
  const Eigen::Vector3d a(line[0], line[1], line[2]), b(line[3], line[4], line[5]);
  if (type == kStopSign) {
    scene->stop_signs.push_back({.id = id, .lanes = lanes, .position_m = 0.5 * (a + b)});
  } else if (type == kYieldSign) {
    scene->note("yield signs, which maps do not have, left out", fmt::format("traffic[{}]", index));
  } else {
    LoggedLight light{.lanes = lanes, .has_stop_line = true, .stop_a_m = a, .stop_b_m = b};
    for (const int32_t state : states) {
      if (state < 0 || state > 4) fail_field("states", "expected 0 to 4, got {}", state);
      light.states.push_back(kStates[state]);
    }
    if (static_cast<int32_t>(states.size()) != scene->num_steps) {
      fail_field("n_states", "expected the {} steps of the agents, got {}", scene->num_steps, states.size());
    }
    scene->lights.push_back(std::move(light));
  }
}

/// Reads the optional blocks at the end of the file: tagged blocks of PufferDrive, or untagged groups of controls of
/// 123Drive.
void read_tails(Cursor* cursor, int32_t controls, LoggedScene* scene) {
  constexpr std::size_t kTag_bytes = 8;
  constexpr std::string_view kPhases = "TLPHASE1", kWidths = "LANEWID1";
  if (cursor->rest().substr(0, kTag_bytes) == kPhases) {
    cursor->take_bytes("TLPHASE1", kTag_bytes);
    cursor->array<int32_t>("TLPHASE1", 2 * controls);
  }
  if (cursor->rest().substr(0, kTag_bytes) == kWidths) {
    cursor->take_bytes("LANEWID1", kTag_bytes);
    constexpr double kMaxWidth_m = 50;
    for (LoggedLane& lane : scene->lanes) {
      for (const float width_m : cursor->array<float>("LANEWID1", static_cast<int32_t>(lane.points.size()))) {
        if (!(width_m > 0 && double{width_m} <= kMaxWidth_m)) {
          fail_field("LANEWID1", "expected a width in (0, {}] m, got {}", kMaxWidth_m, width_m);
        }
        lane.widths_m.push_back(double{width_m});
      }
    }
  }
  if (!cursor->rest().empty()) {
    const int32_t groups = cursor->count("n_control_groups", kMaxRoads);
    if (groups != controls) fail_field("n_control_groups", "expected {}, got {}", controls, groups);
    cursor->array<int32_t>("control_groups", 3 * groups);
  }
  cursor->expect_end();
}

void read_new(Cursor* cursor, LoggedScene* scene) {
  const int32_t agents = cursor->count("n_agents", kMaxTracks), roads = cursor->count("n_roads", kMaxRoads),
                controls = cursor->count("n_traffic", kMaxRoads), objects = cursor->count("n_objects", kMaxTracks);
  for (int32_t i = 0; i < agents; ++i) {
    within("agents", static_cast<std::size_t>(i), [&] { read_agent(cursor, i, true, scene); });
  }
  for (int32_t i = 0; i < roads; ++i) {
    within("roads", static_cast<std::size_t>(i), [&] { read_road(cursor, i, scene); });
  }
  for (int32_t i = 0; i < controls; ++i) {
    within("traffic", static_cast<std::size_t>(i), [&] { read_control(cursor, i, scene); });
  }
  for (int32_t i = 0; i < objects; ++i) {
    within("objects", static_cast<std::size_t>(i), [&] { read_agent(cursor, i, false, scene); });
  }
  const int32_t lanes = cursor->count("n_lanes_graph", kMaxGraphLanes);
  cursor->take_bytes("lane_ids", sizeof(int32_t) * static_cast<std::size_t>(lanes));
  cursor->take_bytes("distances", sizeof(float) * static_cast<std::size_t>(lanes) * static_cast<std::size_t>(lanes));
  constexpr std::size_t kId_bytes = 128, kDataset_bytes = 32;
  scene->id = text_of("scenario_id", cursor->take_bytes("scenario_id", kId_bytes));
  text_of("dataset", cursor->take_bytes("dataset", kDataset_bytes));
  const int32_t steps = cursor->integer("scenario_length");
  if (scene->num_steps != 0 && steps != scene->num_steps) {
    fail_field("scenario_length", "expected the {} steps of the agents, got {}", scene->num_steps, steps);
  }
  scene->dt_s = checked_number("dt", double{cursor->number("dt")});
  scene->objects_of_interest = read_ids(cursor, "objects_of_interest");
  for (const int64_t id : read_ids(cursor, "tracks_to_predict")) {
    if (id < 0 || id >= agents) fail_field("tracks_to_predict", "expected an id in [0, {}), got {}", agents, id);
    scene->predictions.emplace_back(static_cast<int32_t>(id), 0);
  }
  // Some scripts write only empty links. Then lanes are linked where their ends meet.
  scene->has_links = false;
  for (const LoggedLane& lane : scene->lanes) {
    scene->has_links = scene->has_links || !lane.entries.empty() || !lane.exits.empty();
  }
  if (agents > 0) scene->sdc_track = 0;
  read_tails(cursor, controls, scene);
}

}  // namespace

LoggedScene parse_scene(std::string_view bytes, const std::string& source) {
  struct Layout {
    const char* name;
    void (*read)(Cursor*, LoggedScene*);
  };
  constexpr std::array kLayouts{
      Layout{"v1", [](Cursor* cursor, LoggedScene* scene) { read_old(cursor, false, false, scene); }},
      Layout{"v2", [](Cursor* cursor, LoggedScene* scene) { read_old(cursor, true, false, scene); }},
      Layout{"v2 with an id", [](Cursor* cursor, LoggedScene* scene) { read_old(cursor, true, true, scene); }},
      Layout{"v3c", read_new},
  };
  std::string reasons;
  for (const Layout& layout : kLayouts) {
    LoggedScene scene;
    scene.source = source;
    scene.format =
        fmt::format("pufferdrive {}", std::string_view(layout.name).substr(0, layout.name[1] == '3' ? 3 : 2));
    scene.names = {.tracks = "agents", .features = "roads"};
    scene.name = std::filesystem::path(source).stem().string();
    try {
      Cursor cursor(bytes);
      layout.read(&cursor, &scene);
      if (scene.num_steps == 0) fail_field("", "expected at least one agent, got none");
      scene.current_step = std::min(kHistorySteps, scene.num_steps - 1);
      return scene;
    } catch (const FieldError& error) {
      reasons += fmt::format("; as {}: {}{}{}", layout.name, error.path, error.path.empty() ? "" : ": ", error.reason);
    }
  }
  fail("{}: expected a PufferDrive scene of layout v1, v2 or v3c, got {} bytes of another format{}", source,
       bytes.size(), reasons);
}

}  // namespace pictura::pufferdrive
