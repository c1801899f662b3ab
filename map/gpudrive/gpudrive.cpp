#include "pictura/map/gpudrive/gpudrive.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <numbers>

#include "pictura/common/error.h"
#include "pictura/common/hypot.h"
#include "pictura/common/support/json.h"

namespace pictura::gpudrive {

namespace {

using Json = nlohmann::json;

// Time step and steps of history of WOMD, from which the files are made. The files do not contain them.
constexpr double kStep_s = 0.1;
constexpr int32_t kHistorySteps = 10;
constexpr int32_t kMaxId = 1'000'000'000;
constexpr std::size_t kMaxLightStates = 8'000'000;

/// Returns the text with null instead of NaN and Infinity, which Python writes although they are not JSON. Later, null
/// is refused where a number is required. Invalid states are not read and may contain null.
std::string with_null_for_nan(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  bool is_quoted = false;
  for (std::size_t i = 0; i < text.size();) {
    std::size_t length = is_quoted && text[i] == '\\' ? 2 : 1;
    if (text[i] == '"') is_quoted = !is_quoted;
    std::string_view copied = text.substr(i, length);
    if (!is_quoted && (text[i] == 'N' || text[i] == 'I' || text[i] == '-')) {
      for (const std::string_view word : {"NaN", "-Infinity", "Infinity"}) {
        if (!text.substr(i).starts_with(word)) continue;
        length = word.size();
        copied = "null";
      }
    }
    out += copied;
    i += length;
  }
  return out;
}

const Json& member(const Json& object, const char* field) {
  if (!object.is_object()) fail_field("", "expected an object, got {}", object.type_name());
  const auto found = object.find(field);
  if (found == object.end()) fail_field(field, "is missing");
  return *found;
}

const Json& array_of(const Json& object, const char* field) {
  const Json& array = member(object, field);
  if (!array.is_array()) fail_field(field, "expected an array, got {}", array.type_name());
  return array;
}

double number_in(const Json& value, const char* field) {
  if (!value.is_number()) fail_field(field, "expected a number, got {}", value.type_name());
  return checked_number(field, value.get<double>());
}

double number_of(const Json& object, const char* field) { return number_in(member(object, field), field); }

int64_t integer_in(const Json& value, const char* field) {
  if (!value.is_number_integer()) fail_field(field, "expected a whole number, got {}", value.type_name());
  // get<int64_t>() would silently change a number beyond the range of int64_t.
  const bool is_too_large = value.is_number_unsigned() && value.get<uint64_t>() > static_cast<uint64_t>(kMaxId);
  const int64_t number = is_too_large ? 0 : value.get<int64_t>();
  if (is_too_large || number < -kMaxId || number > kMaxId) {
    fail_field(field, "expected a number of at most {} in magnitude, got {}", kMaxId, value.dump());
  }
  return number;
}

int64_t integer_of(const Json& object, const char* field) { return integer_in(member(object, field), field); }

std::string text_of(const Json& object, const char* field) {
  const Json& value = member(object, field);
  if (!value.is_string()) fail_field(field, "expected a text, got {}", value.type_name());
  const std::string& text = value.get_ref<const std::string&>();
  constexpr std::size_t kLongest = 256;
  if (text.size() > kLongest) fail_field(field, "expected at most {} bytes, got {}", kLongest, text.size());
  for (const char letter : text) {
    if (static_cast<unsigned char>(letter) < ' ')
      fail_field(field, "expected no control characters, got {}", int{letter});
  }
  return text;
}

/// Reads a point; flat geometry has no z.
Eigen::Vector3d point_of(const Json& object) {
  return {number_of(object, "x"), number_of(object, "y"), object.contains("z") ? number_of(object, "z") : 0.0};
}

/// Reads a centre. Flat geometry has no z; the centre is then half of the object's height above the ground.
Eigen::Vector3d center_of(const Json& position, double height_m) {
  Eigen::Vector3d center = point_of(position);
  if (!position.contains("z")) center.z() = 0.5 * height_m;
  return center;
}

bool flag_in(const Json& value) {
  if (value.is_boolean()) return value.get<bool>();
  if (value.is_number_integer() && (value == 0 || value == 1)) return value == 1;
  fail_field("", "expected true or false, got {}", value.is_number() ? value.dump() : value.type_name());
}

/// Returns the height of an object; older files have no heights.
double height_of(const Json& object, TrackType type, const std::string& place, LoggedScene* scene) {
  constexpr double kVehicleHeight_m = 1.6, kPersonHeight_m = 1.7;
  if (object.contains("height")) return number_of(object, "height");
  scene->note("objects without a height: vehicles are 1.6 m high, others 1.7 m", place);
  return type == TrackType::vehicle ? kVehicleHeight_m : kPersonHeight_m;
}

void read_object(const Json& object, std::size_t index, LoggedScene* scene) {
  constexpr std::array kTypes{"unset", "vehicle", "pedestrian", "cyclist", "other"};
  LoggedTrack& track = scene->tracks.emplace_back();
  const std::string place = fmt::format("objects[{}]", index);
  if (object.is_object() && !object.contains("id")) {
    scene->note("objects without an id: their places count", place);
    track.id = static_cast<int64_t>(index);
  } else {
    track.id = integer_of(object, "id");
  }
  const std::string type = text_of(object, "type");
  const auto known = std::find(kTypes.begin(), kTypes.end(), type);
  track.type = known == kTypes.end() ? TrackType::other : static_cast<TrackType>(known - kTypes.begin());
  if (object.contains("mark_as_expert")) {
    const Json& mark = object["mark_as_expert"];
    if (!mark.is_boolean()) fail_field("mark_as_expert", "expected true or false, got {}", mark.type_name());
    track.control = mark.get<bool>() ? RecordedControl::expert : RecordedControl::controllable;
  }
  const Json &position = array_of(object, "position"), &heading = array_of(object, "heading"),
             &velocity = array_of(object, "velocity"), &valid = array_of(object, "valid");
  if (scene->num_steps == 0) {
    if (position.empty() || position.size() > static_cast<std::size_t>(kMaxScenarioSteps)) {
      fail_field("position", "expected 1 to {} steps, got {}", kMaxScenarioSteps, position.size());
    }
    scene->num_steps = static_cast<int32_t>(position.size());
  }
  const auto steps = static_cast<std::size_t>(scene->num_steps);
  for (const auto& [field, array] : {std::pair{"position", &position}, std::pair{"heading", &heading},
                                     std::pair{"velocity", &velocity}, std::pair{"valid", &valid}}) {
    if (array->size() != steps) fail_field(field, "expected {} steps, got {}", steps, array->size());
  }
  const double length_m = number_of(object, "length"), width_m = number_of(object, "width"),
               height_m = height_of(object, track.type, place, scene);
  if (object.contains("is_sdc") && within("is_sdc", [&] { return flag_in(object["is_sdc"]); })) {
    scene->sdc_track = static_cast<int32_t>(index);
  }
  for (std::size_t i = 0; i < steps; ++i) {
    LoggedState& state = track.states.emplace_back();
    if (!within("valid", i, [&] { return flag_in(valid[i]); })) continue;
    state.valid = true;
    state.center_m = within("position", i, [&] { return center_of(position[i], height_m); });
    state.heading_rad = within("heading", i, [&] { return number_in(heading[i], ""); });
    within("velocity", i, [&] {
      state.velocity_x_mps = number_of(velocity[i], "x");
      state.velocity_y_mps = number_of(velocity[i], "y");
    });
    state.length_m = length_m;
    state.width_m = width_m;
    state.height_m = height_m;
  }
}

// Numbers of kinds of roads: lanes 0 to 3, lines 5 to 13, edges 14 to 16, and one number for each other kind.
constexpr int64_t kSurfaceLane = 2, kLastLane = 3, kFirstLine = 5, kLastLine = 13, kLastEdge = 16, kStopSign = 17,
                  kCrosswalk = 18, kSpeedBump = 19, kDriveway = 20;

/// Returns the number of a road's kind; older files contain only its name.
int64_t kind_of_road(const Json& road) {
  if (!road.is_object() || road.contains("map_element_id")) return integer_of(road, "map_element_id");
  static const std::map<std::string, int64_t> kKinds{
      {"lane", kSurfaceLane},    {"road_line", kFirstLine},  {"road_edge", kLastEdge}, {"stop_sign", kStopSign},
      {"crosswalk", kCrosswalk}, {"speed_bump", kSpeedBump}, {"driveway", kDriveway}};
  const auto found = kKinds.find(text_of(road, "type"));
  return found == kKinds.end() ? -1 : found->second;
}

void read_road(const Json& road, std::size_t index, LoggedScene* scene) {
  const int64_t type = kind_of_road(road);
  // The index in the file is the id, because the ids of some writers repeat.
  const auto id = static_cast<int64_t>(index);
  const Json& geometry = array_of(road, "geometry");
  LoggedPoints points;
  for (std::size_t i = 0; i < geometry.size(); ++i) {
    points.push_back(within("geometry", i, [&] { return point_of(geometry[i]); }));
  }
  if (type >= 0 && type <= kLastLane) {
    scene->lanes.push_back({.id = id, .type = static_cast<LoggedLaneType>(type), .points = std::move(points)});
  } else if (type >= kFirstLine && type <= kLastLine) {
    scene->lines.push_back(
        {.id = id, .type = static_cast<LoggedLineType>(type - kFirstLine), .points = std::move(points)});
  } else if (type > kLastLine && type <= kLastEdge) {
    scene->edges.push_back({.id = id, .points = std::move(points)});
  } else if (type == kCrosswalk) {
    scene->crosswalks.push_back({.id = id, .points = std::move(points)});
  } else if (type == kStopSign) {
    if (points.empty()) fail_field("geometry", "expected the point of a stop sign, got none");
    scene->stop_signs.push_back({.id = id, .position_m = points[0]});
  } else if (type == kSpeedBump || type == kDriveway) {
    scene->note("speed bumps and driveways, which maps do not have, left out", fmt::format("roads[{}]", index));
  } else {
    scene->note("roads of no known kind left out", fmt::format("roads[{}]", index));
  }
}

RecordedLightState light_state(const std::string& text) {
  if (text == "unknown") return RecordedLightState::none;
  for (int i = 1; i <= static_cast<int>(RecordedLightState::flashing_caution); ++i) {
    const auto state = static_cast<RecordedLightState>(i);
    if (text == to_string(state)) return state;
  }
  fail_field("", "expected a state such as stop, caution, go or unknown, got '{}'", text);
}

/// Reads a light. `lane_ids` maps the id of each lane, as text, to the lane's index in the file.
void read_light(const std::string& lane, const Json& light, const std::map<std::string, int64_t>& lane_ids,
                LoggedScene* scene) {
  const Json& states = array_of(light, "state");
  const auto steps = static_cast<std::size_t>(scene->num_steps);
  const auto found = lane_ids.find(lane);
  if (found == lane_ids.end()) {
    scene->note("lights of lanes that the map does not have left out", fmt::format("tl_states.{}", lane));
    return;
  }
  LoggedLight logged;
  logged.lanes = {found->second};
  logged.states.assign(steps, RecordedLightState::none);
  for (std::size_t i = 0; i < states.size(); ++i) {
    std::size_t step = i;
    if (light.contains("time_index")) {
      const Json& times = array_of(light, "time_index");
      if (times.size() != states.size()) {
        fail_field("time_index", "expected {} elements, got {}", states.size(), times.size());
      }
      within("time_index", i, [&] {
        const int64_t time = times[i].is_number_integer() ? times[i].get<int64_t>() : -1;
        if (time < 0 || time >= static_cast<int64_t>(steps)) {
          fail_field("", "expected a step in [0, {}), got {}", steps,
                     times[i].is_number_integer() ? times[i].dump() : times[i].type_name());
        }
        step = static_cast<std::size_t>(time);
      });
    }
    if (step >= steps) fail_field("state", "expected at most {} steps, got {}", steps, states.size());
    within("state", i, [&] {
      if (!states[i].is_string()) fail_field("", "expected a text, got {}", states[i].type_name());
      logged.states[step] = light_state(states[i].get<std::string>());
    });
  }
  scene->lights.push_back(std::move(logged));
}

/// Returns the lane of a light in a list, where each light contains its lane.
std::string lane_of_light(const Json& light) {
  for (const char* field : {"lane", "lane_id", "id"}) {
    if (!light.is_object() || !light.contains(field)) continue;
    return light[field].is_string() ? text_of(light, field) : std::to_string(integer_of(light, field));
  }
  fail_field("lane", "is missing");
}

void read_lights(const Json& lights, const Json& roads, LoggedScene* scene) {
  if (lights.is_null()) return;
  if (!lights.is_object() && !lights.is_array()) {
    fail_field("tl_states", "expected an object or an array, got {}", lights.type_name());
  }
  const auto steps = static_cast<std::size_t>(scene->num_steps);
  if (lights.size() * steps > kMaxLightStates) {
    fail_field("tl_states", "expected at most {} lights at {} steps, got {}", kMaxLightStates / steps, steps,
               lights.size());
  }
  std::map<std::string, int64_t> lane_ids;
  for (const LoggedLane& lane : scene->lanes) {
    const Json& road = roads[static_cast<std::size_t>(lane.id)];
    if (!road.contains("id") || !road["id"].is_number_integer()) continue;
    lane_ids.emplace(road["id"].dump(), lane.id);
  }
  if (lights.is_array()) {
    for (std::size_t i = 0; i < lights.size(); ++i) {
      within("tl_states", i, [&] { read_light(lane_of_light(lights[i]), lights[i], lane_ids, scene); });
    }
    return;
  }
  for (const auto& light : lights.items()) {
    within("tl_states", [&] { within(light.key(), [&] { read_light(light.key(), light.value(), lane_ids, scene); }); });
  }
}

/// Converts the headings of older files from degrees to radians. Headings are degrees if, read as degrees, the headings
/// of moving objects fit their motion better, and either do not fit it as radians, or one exceeds a whole turn in
/// radians. If they fit equally well, headings are degrees if any exceeds a whole turn in radians.
void convert_degrees(LoggedScene* scene) {
  constexpr double kMoving_mps = 0.5, kLargest_rad = 6.3, kRadians = std::numbers::pi / 180;
  // Mean cosine of radians that fit. Headings near 0, of traffic along +x, fit as radians and slightly better as
  // degrees.
  constexpr double kGoodFit = 0.5;
  double fit = 0, fit_of_degrees = 0;  // sums of the cosines between heading and motion
  int moving = 0;
  bool is_large = false;
  for (const LoggedTrack& track : scene->tracks) {
    for (const LoggedState& state : track.states) {
      if (!state.valid) continue;
      is_large = is_large || std::abs(state.heading_rad) > kLargest_rad;
      if (!(hypot_of(state.velocity_x_mps, state.velocity_y_mps) > kMoving_mps)) continue;
      const double motion = std::atan2(state.velocity_y_mps, state.velocity_x_mps);
      ++moving;
      fit += std::cos(state.heading_rad - motion);
      fit_of_degrees += std::cos(kRadians * state.heading_rad - motion);
    }
  }
  const bool are_degrees =
      is_large ? fit_of_degrees >= fit : fit_of_degrees > fit && fit < kGoodFit * static_cast<double>(moving);
  if (!are_degrees) return;
  for (std::size_t i = 0; i < scene->tracks.size(); ++i) {
    bool is_present = false;
    for (LoggedState& state : scene->tracks[i].states) {
      state.heading_rad *= kRadians;
      is_present = is_present || state.valid;
    }
    if (is_present) scene->note("tracks whose headings are degrees", fmt::format("objects[{}]", i));
  }
}

void read_metadata(const Json& metadata, LoggedScene* scene) {
  const auto tracks = static_cast<int64_t>(scene->tracks.size());
  // Indices refer to the tracks of the recording. The file may lack some of these tracks.
  const auto is_track = [&](int64_t index, const char* what) {
    if (index >= 0 && index < tracks) return true;
    scene->note("indices of the recording's tracks that are no object of the file left out", what);
    return false;
  };
  if (metadata.contains("sdc_track_index")) {
    const int64_t index = integer_of(metadata, "sdc_track_index");
    // An object that is itself marked as the self-driving car takes precedence over the index.
    if (scene->sdc_track < 0 && is_track(index, "sdc_track_index")) scene->sdc_track = static_cast<int32_t>(index);
  }
  if (metadata.contains("objects_of_interest")) {
    for (const Json& id : array_of(metadata, "objects_of_interest")) {
      scene->objects_of_interest.push_back(integer_in(id, "objects_of_interest"));
    }
  }
  if (metadata.contains("tracks_to_predict")) {
    const Json& predictions = array_of(metadata, "tracks_to_predict");
    for (std::size_t i = 0; i < predictions.size(); ++i) {
      within("tracks_to_predict", i, [&] {
        const int64_t index = integer_of(predictions[i], "track_index");
        const int64_t difficulty = predictions[i].contains("difficulty") ? integer_of(predictions[i], "difficulty") : 0;
        if (!is_track(index, "tracks_to_predict")) return;
        scene->predictions.emplace_back(static_cast<int32_t>(index), static_cast<int32_t>(difficulty));
      });
    }
  }
}

}  // namespace

LoggedScene parse_scene(std::string_view text, const std::string& source) {
  LoggedScene scene;
  scene.source = source;
  scene.format = "gpudrive";
  scene.names = {.tracks = "objects", .features = "roads"};
  scene.has_links = false;
  scene.dt_s = kStep_s;
  scene.name = std::filesystem::path(source).stem().string();
  try {
    Json json;
    try {
      json = parse_json<Json>(with_null_for_nan(text));
    } catch (const Json::exception& error) {
      // The library's messages look like "[json.exception.parse_error.101] parse error at line 1, column 2: ..."
      std::string reason = error.what();
      reason.erase(0, reason.find(']') == std::string::npos ? 0 : reason.find(']') + 2);
      fail_field("", "expected JSON, got a {}", reason);
    }
    if (json.is_object() && json.contains("scenario_id")) {
      const Json& id = json["scenario_id"];
      scene.id = id.is_number_integer() ? id.dump() : text_of(json, "scenario_id");
    }
    const Json& objects = array_of(json, "objects");
    if (objects.size() > static_cast<std::size_t>(kMaxScenarioTracks)) {
      fail_field("objects", "expected at most {}, got {}", kMaxScenarioTracks, objects.size());
    }
    for (std::size_t i = 0; i < objects.size(); ++i) within("objects", i, [&] { read_object(objects[i], i, &scene); });
    if (objects.empty()) fail_field("objects", "expected at least one, got none");
    convert_degrees(&scene);
    scene.current_step = std::min(kHistorySteps, scene.num_steps - 1);
    const Json& roads = array_of(json, "roads");
    for (std::size_t i = 0; i < roads.size(); ++i) within("roads", i, [&] { read_road(roads[i], i, &scene); });
    if (json.contains("tl_states")) read_lights(json["tl_states"], roads, &scene);
    if (json.contains("metadata")) within("metadata", [&] { read_metadata(member(json, "metadata"), &scene); });
  } catch (const FieldError& error) {
    throw to_error(source, error);
  } catch (const Json::exception& error) {
    fail("{}: {}", source, error.what());
  }
  return scene;
}

}  // namespace pictura::gpudrive
