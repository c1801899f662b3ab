#include "pictura/replay/mcap.h"

#include <cmath>

#include <nlohmann/json.hpp>
#include <png.h>

#include "pictura/common/error.h"
#include "pictura/common/support/json_text.h"
#include "pictura/replay/encoding.h"
#include "pictura/replay/images.h"
#include "pictura/replay/mcap_writer.h"

namespace pictura {

namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kFrame = "map";  // coordinate frame in metres: x east, y north, z up
constexpr double kRadPerDdeg = 3.14159265358979323846 / 1800;

Json time_json(uint64_t ns) { return {{"sec", ns / 1000000000}, {"nsec", ns % 1000000000}}; }
Json vector_json(double x, double y, double z) { return {{"x", x}, {"y", y}, {"z", z}}; }
Json color_json(double r, double g, double b, double a = 1) { return {{"r", r}, {"g", g}, {"b", b}, {"a", a}}; }
Json pose_json(double x, double y, double z, double heading_rad) {
  return {{"position", vector_json(x, y, z)},
          {"orientation", {{"x", 0}, {"y", 0}, {"z", std::sin(heading_rad / 2)}, {"w", std::cos(heading_rad / 2)}}}};
}

// Schemas with the names of Foxglove's schemas. They contain only the members that are written.
Json object_schema(Json properties) { return {{"type", "object"}, {"properties", std::move(properties)}}; }
Json numbers_schema(std::initializer_list<const char*> names) {
  Json properties;
  for (const char* name : names) properties[name] = {{"type", "number"}};
  return object_schema(properties);
}
Json time_schema() { return object_schema({{"sec", {{"type", "integer"}}}, {"nsec", {{"type", "integer"}}}}); }
Json array_schema(Json items) { return {{"type", "array"}, {"items", std::move(items)}}; }
const Json kText = {{"type", "string"}};

Json scene_schema() {
  const Json point = numbers_schema({"x", "y", "z"}), color = numbers_schema({"r", "g", "b", "a"});
  const Json pose = object_schema({{"position", point}, {"orientation", numbers_schema({"x", "y", "z", "w"})}});
  const Json solid = object_schema({{"pose", pose}, {"size", point}, {"color", color}});
  const Json line = object_schema({{"type", {{"type", "integer"}}},
                                   {"pose", pose},
                                   {"thickness", {{"type", "number"}}},
                                   {"scale_invariant", {{"type", "boolean"}}},
                                   {"points", array_schema(point)},
                                   {"color", color},
                                   {"colors", array_schema(color)},
                                   {"indices", array_schema({{"type", "integer"}})}});
  const Json text = object_schema({{"pose", pose},
                                   {"billboard", {{"type", "boolean"}}},
                                   {"font_size", {{"type", "number"}}},
                                   {"scale_invariant", {{"type", "boolean"}}},
                                   {"color", color},
                                   {"text", kText}});
  const Json entity = object_schema({{"timestamp", time_schema()},
                                     {"frame_id", kText},
                                     {"id", kText},
                                     {"lifetime", time_schema()},
                                     {"frame_locked", {{"type", "boolean"}}},
                                     {"metadata", array_schema(object_schema({{"key", kText}, {"value", kText}}))},
                                     {"cubes", array_schema(solid)},
                                     {"spheres", array_schema(solid)},
                                     {"lines", array_schema(line)},
                                     {"texts", array_schema(text)}});
  return object_schema(
      {{"deletions", array_schema(object_schema(Json::object()))}, {"entities", array_schema(entity)}});
}
Json log_schema() {
  return object_schema(
      {{"timestamp", time_schema()}, {"level", {{"type", "integer"}}}, {"message", kText}, {"name", kText}});
}
Json image_schema() {
  return object_schema({{"timestamp", time_schema()},
                        {"frame_id", kText},
                        {"data", {{"type", "string"}, {"contentEncoding", "base64"}}},
                        {"format", kText}});
}

Json entity_json(uint64_t ns, const char* id) {
  return {{"timestamp", time_json(ns)}, {"frame_id", kFrame},    {"id", id},
          {"lifetime", time_json(0)},   {"frame_locked", false}, {"metadata", Json::array()}};
}
Json scene_json(Json entity) { return {{"deletions", Json::array()}, {"entities", Json::array({std::move(entity)})}}; }

Json shape_color(const ReplayShape& shape) {
  switch (shape.kind) {
    case ShapeKind::marking: return shape.detail == 1 ? color_json(0.85, 0.68, 0.18) : color_json(0.8, 0.82, 0.86);
    case ShapeKind::road_edge: return color_json(0.69, 0.25, 0.24);
    case ShapeKind::wall: return color_json(0.5, 0.54, 0.61);
    case ShapeKind::crosswalk: return color_json(0.72, 0.76, 0.8);
    case ShapeKind::stop_line: return color_json(0.56, 0.78, 0.96);
    default: return color_json(0.35, 0.38, 0.43);
  }
}

Json map_json(const Replay& replay) {
  Json lines = Json::array();
  for (const ReplayShape& shape : replay.map) {
    // Lanes are not drawn, because other drawn shapes show their edges.
    if (shape.kind == ShapeKind::light || shape.kind == ShapeKind::lane) continue;
    const bool is_ring = shape.kind == ShapeKind::crosswalk || shape.kind == ShapeKind::parking_space;
    Json points = Json::array();
    for (const auto& [x_cm, y_cm] : shape.points_cm) points.push_back(vector_json(x_cm / 100.0, y_cm / 100.0, 0));
    lines.push_back({{"type", is_ring ? 1 : 0},  // 1: closed loop, 0: open line
                     {"pose", pose_json(0, 0, 0, 0)},
                     {"thickness", std::max(0.1, shape.width_cm / 100.0)},
                     {"scale_invariant", false},
                     {"points", std::move(points)},
                     {"color", shape_color(shape)},
                     {"colors", Json::array()},
                     {"indices", Json::array()}});
  }
  Json entity = entity_json(0, "map");
  entity["lines"] = std::move(lines);
  return scene_json(std::move(entity));
}

Json body_color(AgentClass agent_class, bool is_halted) {
  const double alpha = is_halted ? 0.5 : 1;
  switch (agent_class) {
    case AgentClass::cyclist: return color_json(1, 0.69, 0.18, alpha);
    case AgentClass::pedestrian: return color_json(0.37, 0.86, 0.55, alpha);
    default: return color_json(0.35, 0.71, 1, alpha);
  }
}

Json cube_json(const ReplayBody& body, double x_m, double y_m, double z_m, double heading_rad, Json color) {
  return {{"pose", pose_json(x_m, y_m, z_m + body.height_cm / 200.0, heading_rad)},
          {"size", vector_json(body.length_cm / 100.0, body.width_cm / 100.0, body.height_cm / 100.0)},
          {"color", std::move(color)}};
}

Json agents_json(const Replay& replay, const ReplayEpisode& episode, int frame, uint64_t ns) {
  Json cubes = Json::array(), texts = Json::array();
  for (const ReplayBox& car : episode.parked) {
    cubes.push_back(cube_json(car.body, car.x_cm / 100.0, car.y_cm / 100.0, car.z_cm / 100.0,
                              car.heading_ddeg * kRadPerDdeg, color_json(0.36, 0.41, 0.47)));
  }
  for (int agent = 0; agent < replay.num_agents; ++agent) {
    const int32_t status = replay.at(Track::status, frame, agent);
    if (status == static_cast<int32_t>(AgentStatus::absent)) continue;
    const ReplayBody& body = episode.agents[agent];
    const double x_m = replay.at(Track::x_m, frame, agent) / 100.0, y_m = replay.at(Track::y_m, frame, agent) / 100.0;
    const double z_m = replay.at(Track::z_m, frame, agent) / 100.0;
    const bool is_halted = status == static_cast<int32_t>(AgentStatus::halted);
    cubes.push_back(cube_json(body, x_m, y_m, z_m, replay.at(Track::heading_deg, frame, agent) * kRadPerDdeg,
                              body_color(body.agent_class, is_halted)));
    texts.push_back({{"pose", pose_json(x_m, y_m, z_m + body.height_cm / 100.0 + 0.8, 0)},
                     {"billboard", true},
                     {"font_size", 12},
                     {"scale_invariant", true},
                     {"color", color_json(1, 1, 1)},
                     {"text", std::to_string(agent)}});
  }
  Json entity = entity_json(ns, "agents");
  entity["cubes"] = std::move(cubes);
  entity["texts"] = std::move(texts);
  return scene_json(std::move(entity));
}

Json lights_json(const Replay& replay, int frame, uint64_t ns) {
  Json spheres = Json::array();
  size_t light = static_cast<size_t>(frame) * static_cast<size_t>(replay.num_lights);
  for (const ReplayShape& shape : replay.map) {
    if (shape.kind != ShapeKind::light) continue;
    const auto state = static_cast<LightState>(replay.lights[light++]);
    if (state == LightState::unknown) continue;
    const Rgb color = light_color(state);
    const auto& [x_cm, y_cm] = shape.points_cm[2];  // the head
    spheres.push_back({{"pose", pose_json(x_cm / 100.0, y_cm / 100.0, 5, 0)},
                       {"size", vector_json(1, 1, 1)},
                       {"color", color_json(color.r, color.g, color.b)}});
  }
  Json entity = entity_json(ns, "lights");
  entity["spheres"] = std::move(spheres);
  return scene_json(std::move(entity));
}

// Returns the numbers of one agent, for plots.
Json agent_json(const Replay& replay, int frame, int agent) {
  Json numbers{{"agent", agent}};
  for (size_t track = 0; track < kNumTracks; ++track) {
    numbers[std::string(kTracks[track].name)] =
        replay.at(static_cast<Track>(track), frame, agent) * kTracks[track].unit;
  }
  if (replay.decisions.empty()) return numbers;
  const int32_t* decision = replay.decisions.data() + static_cast<size_t>(frame) * kDecisionValues;
  Json probabilities = Json::array();
  for (size_t i = 0; i < kNumActions; ++i) probabilities.push_back(decision[i] * kDecisionUnit);
  numbers["probabilities"] = probabilities;
  numbers["value"] = decision[kNumActions] * kDecisionUnit;
  return numbers;
}
Json agent_schema() {
  Json properties{{"agent", {{"type", "integer"}}}};
  for (const TrackInfo& track : kTracks) properties[std::string(track.name)] = {{"type", "number"}};
  properties["probabilities"] = array_schema({{"type", "number"}});
  properties["value"] = {{"type", "number"}};
  return object_schema(properties);
}

constexpr std::array<std::pair<int32_t, const char*>, 6> kEventNames{{{kEventCollision, "collision"},
                                                                      {kEventAtFault, "at fault"},
                                                                      {kEventOffRoad, "off road"},
                                                                      {kEventRedLight, "red light"},
                                                                      {kEventWall, "wall"},
                                                                      {kEventMetricGoal, "goal"}}};
constexpr int kInfo = 2, kWarning = 3;  // log levels of foxglove.Log

std::string png_of(const ReplayCamera& camera, const char* rgb) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(camera.width_px);
  image.height = static_cast<png_uint_32>(camera.height_px);
  image.format = PNG_FORMAT_RGB;
  png_alloc_size_t bytes = PNG_IMAGE_PNG_SIZE_MAX(image);
  std::string png(bytes, '\0');
  PICTURA_CHECK(png_image_write_to_memory(&image, png.data(), &bytes, 0, rgb, 0, nullptr), "an image: {}",
                image.message);
  png.resize(bytes);
  return png;
}

/// Returns the position of an agent as text, in the coordinates of the map's file.
std::string place_text(const Replay& replay, int frame, int agent) {
  const auto coordinate = [&](Track track, size_t axis) {
    return 0.01 * replay.at(track, frame, agent) + replay.origin.map_origin_m[axis];
  };
  return fmt::format("({:.2f}, {:.2f})", coordinate(Track::x_m, 0), coordinate(Track::y_m, 1));
}

}  // namespace

void write_mcap(const std::string& path, const Replay& replay) {
  const ReplayOrigin& origin = replay.origin;
  McapWriter writer(path, "pictura " + origin.version);
  const std::string scene = scene_schema().dump();
  const uint16_t map = writer.add_channel("/map", "foxglove.SceneUpdate", scene);
  const uint16_t agents = writer.add_channel("/agents", "foxglove.SceneUpdate", scene);
  const uint16_t lights = writer.add_channel("/lights", "foxglove.SceneUpdate", scene);
  const uint16_t events = writer.add_channel("/events", "foxglove.Log", log_schema().dump());
  const uint16_t agent_channel = writer.add_channel("/agent", "pictura.Agent", agent_schema().dump());
  std::vector<uint16_t> cameras;
  const int num_pictured = replay.num_pictured_frames();
  for (const ReplayCamera& camera : replay.cameras) {
    if (num_pictured == 0) break;
    cameras.push_back(writer.add_channel("/camera/" + camera.name, "foxglove.CompressedImage", image_schema().dump()));
  }
  writer.add_message(map, 0, json_text(map_json(replay)));

  // The duration is rounded to microseconds, because the float nearest to 0.1 s differs from 0.1 s by more than a
  // nanosecond.
  const auto step_ns = static_cast<uint64_t>(std::llround(static_cast<double>(origin.dt_s) * 1e6)) * 1000;
  std::string frames;  // decompressed frames of the current group of images
  size_t episode = 0;
  for (int frame = 0; frame < replay.num_frames; ++frame) {
    const uint64_t ns = static_cast<uint64_t>(frame) * step_ns;
    const auto index = static_cast<size_t>(frame);
    while (frame >= replay.episodes[episode].first_frame + replay.episodes[episode].num_frames) ++episode;
    writer.add_message(agents, ns, json_text(agents_json(replay, replay.episodes[episode], frame, ns)));
    const auto num_lights = static_cast<size_t>(replay.num_lights);
    const auto now = replay.lights.begin() + static_cast<ptrdiff_t>(index * num_lights);
    if (frame == 0 ||
        !std::equal(now, now + static_cast<ptrdiff_t>(num_lights), now - static_cast<ptrdiff_t>(num_lights))) {
      writer.add_message(lights, ns, json_text(lights_json(replay, frame, ns)));
    }
    writer.add_message(agent_channel, ns, json_text(agent_json(replay, frame, std::max(0, replay.followed_at(frame)))));
    for (int agent = 0; agent < replay.num_agents; ++agent) {
      const int32_t bits = replay.at(Track::events, frame, agent);
      std::string names;
      for (const auto& [bit, name] : kEventNames) {
        if ((bits & bit) != 0) names += (names.empty() ? "" : ", ") + std::string(name);
      }
      if (names.empty()) continue;
      writer.add_message(
          events, ns,
          json_text(Json{{"timestamp", time_json(ns)},
                         {"level", (bits & kInfractions) != 0 ? kWarning : kInfo},
                         {"message", fmt::format("agent {} at {}: {}", agent, place_text(replay, frame, agent), names)},
                         {"name", origin.map}}));
    }
    if (frame >= num_pictured) continue;
    const int per_group = replay.images.frames_per_group, in_group = frame % per_group;
    if (in_group == 0) {
      frames = unpack_images(replay.cameras, replay.images.groups[index / static_cast<size_t>(per_group)],
                             std::min(per_group, num_pictured - frame));
    }
    const char* rgb = frames.data() + static_cast<size_t>(in_group) * bytes_of_frame(replay.cameras);
    for (size_t i = 0; i < cameras.size(); ++i) {
      const ReplayCamera& camera = replay.cameras[i];
      writer.add_message(cameras[i], ns,
                         Json{{"timestamp", time_json(ns)},
                              {"frame_id", camera.name},
                              {"data", base64(png_of(camera, rgb))},
                              {"format", "png"}}
                             .dump());
      rgb += bytes_of_frame({camera});
    }
  }
  writer.add_metadata("pictura", {{"command", origin.command},
                                  {"commit", origin.commit},
                                  {"map", origin.map},
                                  {"map_hash", origin.map_hash},
                                  {"origin_m", fmt::format("{}", fmt::join(origin.map_origin_m, " "))},
                                  {"policy", origin.policy},
                                  {"policy_hash", origin.policy_hash},
                                  {"light_cycles", origin.light_cycles},
                                  {"seed", std::to_string(origin.seed)}});
  writer.finish();
}

}  // namespace pictura
