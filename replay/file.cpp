#include "pictura/replay/file.h"

#include <algorithm>
#include <cstring>
#include <optional>
#include <set>

#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/common/support/json.h"
#include "pictura/common/support/numbers.h"
#include "pictura/replay/encoding.h"
#include "pictura/replay/images.h"
#include "pictura/replay/page_sources.h"
#include "pictura/replay/template.h"
#include "pictura/simulator/conditioning.h"
#include "pictura/simulator/rules/limits.h"

namespace pictura {

namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kFormat = "pictura replay";
// Markers for the reader. The script of the page finds the elements by the same ids.
constexpr std::string_view kHeaderBegin = "<script type=\"application/json\" id=\"replay-header\">";
constexpr std::string_view kDataBegin = "<script type=\"text/plain\" id=\"replay-data\">";
constexpr std::string_view kImagesBegin = "<script type=\"text/plain\" id=\"replay-images\">";
constexpr std::string_view kEnd = "</script>";

size_t size(int32_t count) { return static_cast<size_t>(count); }

// Writers and readers of the sections:

std::string map_bytes(const std::vector<ReplayShape>& map) {
  std::string bytes;
  put_number(static_cast<int32_t>(map.size()), &bytes);
  std::array<int32_t, 2> before{};
  for (const ReplayShape& shape : map) {
    put_number(static_cast<int32_t>(shape.kind), &bytes);
    put_number(shape.detail, &bytes);
    put_number(shape.width_cm, &bytes);
    put_number(static_cast<int32_t>(shape.points_cm.size()), &bytes);
    for (const std::array<int32_t, 2>& point : shape.points_cm) {
      for (size_t i = 0; i < 2; ++i) put_number(point[i] - before[i], &bytes);
      before = point;
    }
  }
  return bytes;
}

std::vector<ReplayShape> map_from(NumberReader reader) {
  std::vector<ReplayShape> map(size(reader.next_count()));
  std::array<int32_t, 2> at{};
  for (ReplayShape& shape : map) {
    const int32_t kind = reader.next();
    PICTURA_CHECK(kind >= 0 && kind < kNumShapeKinds, "map: expected a kind of 0 to {}, got {}", kNumShapeKinds - 1,
                  kind);
    shape.kind = static_cast<ShapeKind>(kind);
    shape.detail = reader.next();
    shape.width_cm = reader.next();
    shape.points_cm.resize(size(reader.next_count()));
    for (std::array<int32_t, 2>& point : shape.points_cm) {
      for (size_t i = 0; i < 2; ++i)
        at[i] = static_cast<int32_t>(static_cast<uint32_t>(at[i]) + static_cast<uint32_t>(reader.next()));
      point = at;
    }
  }
  return map;
}

// Writes points as differences from the previous point, across all objects.
class PointWriter {
 public:
  explicit PointWriter(std::string* bytes) : bytes_(bytes) {}
  void put(const ReplayPoint& point) {
    for (size_t i = 0; i < point.size(); ++i) put_number(point[i] - before_[i], bytes_);
    before_ = point;
  }

 private:
  std::string* bytes_;
  ReplayPoint before_{};
};
class PointReader {
 public:
  explicit PointReader(NumberReader* reader) : reader_(reader) {}
  ReplayPoint next() {
    for (int32_t& value : at_)
      value = static_cast<int32_t>(static_cast<uint32_t>(value) + static_cast<uint32_t>(reader_->next()));
    return at_;
  }

 private:
  NumberReader* reader_;
  ReplayPoint at_{};
};

void put_hue(const ReplayHue& hue, std::string* bytes_inout) {
  for (const uint8_t channel : hue) put_number(channel, bytes_inout);
}
ReplayHue next_hue(NumberReader* reader) {
  ReplayHue hue;
  for (uint8_t& channel : hue) channel = static_cast<uint8_t>(reader->next());
  return hue;
}

std::string scenery_bytes(const ReplayScenery& scenery) {
  std::string bytes;
  PointWriter points(&bytes);
  put_number(static_cast<int32_t>(scenery.lines.size()), &bytes);
  for (const ReplayLine& line : scenery.lines) {
    put_number(static_cast<int32_t>(line.kind), &bytes);
    put_hue(line.color, &bytes);
    put_number(line.width_mm, &bytes);
    put_number(static_cast<int32_t>(line.points_cm.size()), &bytes);
    for (const ReplayPoint& point : line.points_cm) points.put(point);
  }
  put_number(static_cast<int32_t>(scenery.walls.size()), &bytes);
  for (const ReplayWall& wall : scenery.walls) {
    put_hue(wall.color, &bytes);
    put_number(wall.height_cm, &bytes);
    points.put(wall.a_cm);
    points.put(wall.b_cm);
  }
  put_number(static_cast<int32_t>(scenery.heads.size()), &bytes);
  for (const ReplayHead& head : scenery.heads) {
    for (const int32_t value : {head.signal, head.facing_ddeg, head.half_angle_ddeg}) put_number(value, &bytes);
    points.put(head.position_cm);
  }
  return bytes;
}

ReplayScenery scenery_from(NumberReader reader) {
  ReplayScenery scenery;
  PointReader points(&reader);
  scenery.lines.resize(size(reader.next_count()));
  for (ReplayLine& line : scenery.lines) {
    const int32_t kind = reader.next();
    PICTURA_CHECK(kind >= 0 && kind < kNumStripKinds, "scenery: expected a kind of 0 to {}, got {}", kNumStripKinds - 1,
                  kind);
    line.kind = static_cast<StripKind>(kind);
    line.color = next_hue(&reader);
    line.width_mm = reader.next();
    line.points_cm.resize(size(reader.next_count()));
    for (ReplayPoint& point : line.points_cm) point = points.next();
  }
  scenery.walls.resize(size(reader.next_count()));
  for (ReplayWall& wall : scenery.walls) {
    wall.color = next_hue(&reader);
    wall.height_cm = reader.next();
    wall.a_cm = points.next();
    wall.b_cm = points.next();
  }
  scenery.heads.resize(size(reader.next_count()));
  for (ReplayHead& head : scenery.heads) {
    for (int32_t* value : {&head.signal, &head.facing_ddeg, &head.half_angle_ddeg}) *value = reader.next();
    head.position_cm = points.next();
  }
  return scenery;
}

void put_body(const ReplayBody& body, std::string* bytes_inout) {
  put_number(static_cast<int32_t>(body.agent_class), bytes_inout);
  for (const int32_t size_cm : {body.length_cm, body.width_cm, body.height_cm}) put_number(size_cm, bytes_inout);
}
AgentClass class_from(std::string_view where, int32_t number) {
  PICTURA_CHECK(number >= 0 && number < kNumAgentClasses, "{}: expected a class of 0 to {}, got {}", where,
                kNumAgentClasses - 1, number);
  return static_cast<AgentClass>(number);
}
ReplayBody next_body(NumberReader* reader) {
  ReplayBody body;
  body.agent_class = class_from("episodes", reader->next());
  for (int32_t* size_cm : {&body.length_cm, &body.width_cm, &body.height_cm}) *size_cm = reader->next();
  return body;
}

std::string episode_bytes(const std::vector<ReplayEpisode>& episodes) {
  std::string bytes;
  put_number(static_cast<int32_t>(episodes.size()), &bytes);
  for (const ReplayEpisode& episode : episodes) {
    for (const int32_t value : {episode.index, episode.first_frame, episode.num_frames}) put_number(value, &bytes);
    for (const ReplayBody& body : episode.agents) put_body(body, &bytes);
    put_number(static_cast<int32_t>(episode.parked.size()), &bytes);
    for (const ReplayBox& car : episode.parked) {
      put_body(car.body, &bytes);
      for (const int32_t value : {car.x_cm, car.y_cm, car.z_cm, car.heading_ddeg}) put_number(value, &bytes);
    }
    put_number(static_cast<int32_t>(episode.chains.size()), &bytes);
    for (const ReplayChain& chain : episode.chains) {
      put_number(chain.frame, &bytes);
      put_number(chain.agent, &bytes);
      for (const auto* values : {&chain.x_cm, &chain.y_cm, &chain.z_cm}) {
        for (const int32_t value : *values) put_number(value, &bytes);
      }
    }
  }
  return bytes;
}

std::vector<ReplayEpisode> episodes_from(NumberReader reader, int32_t num_agents) {
  std::vector<ReplayEpisode> episodes(size(reader.next_count()));
  for (ReplayEpisode& episode : episodes) {
    for (int32_t* value : {&episode.index, &episode.first_frame, &episode.num_frames}) *value = reader.next();
    for (int32_t agent = 0; agent < num_agents; ++agent) episode.agents.push_back(next_body(&reader));
    episode.parked.resize(size(reader.next_count()));
    for (ReplayBox& car : episode.parked) {
      car.body = next_body(&reader);
      for (int32_t* value : {&car.x_cm, &car.y_cm, &car.z_cm, &car.heading_ddeg}) *value = reader.next();
    }
    episode.chains.resize(size(reader.next_count()));
    for (ReplayChain& chain : episode.chains) {
      chain.frame = reader.next();
      chain.agent = reader.next();
      PICTURA_CHECK(chain.agent >= 0 && chain.agent < num_agents, "episodes: expected an agent of 0 to {}, got {}",
                    num_agents - 1, chain.agent);
      for (auto* values : {&chain.x_cm, &chain.y_cm, &chain.z_cm}) {
        for (int32_t& value : *values) value = reader.next();
      }
    }
  }
  return episodes;
}

std::string conditioning_bytes(const std::vector<ReplayEpisode>& episodes) {
  std::string bytes;
  for (const ReplayEpisode& episode : episodes) {
    bytes.append(reinterpret_cast<const char*>(episode.conditioning.data()),
                 episode.conditioning.size() * sizeof(float));
  }
  return bytes;
}

void conditioning_from(std::string_view bytes, int32_t num_agents, std::vector<ReplayEpisode>* episodes_inout) {
  const size_t count = size(num_agents) * kNumConditioning;
  PICTURA_CHECK(bytes.size() == episodes_inout->size() * count * sizeof(float),
                "conditioning: expected {} numbers per episode, got {} bytes", count, bytes.size());
  for (size_t i = 0; i < episodes_inout->size(); ++i) {
    std::vector<float>& conditioning = (*episodes_inout)[i].conditioning;
    conditioning.resize(count);
    std::memcpy(conditioning.data(), bytes.data() + i * count * sizeof(float), count * sizeof(float));
  }
}

// Writes the columns of [frames, columns] one after the other, each through all frames.
std::string column_bytes(const int32_t* first, size_t frames, size_t columns, int order) {
  std::string bytes;
  for (size_t column = 0; column < columns; ++column) put_differences(first + column, frames, columns, order, &bytes);
  return bytes;
}
std::vector<int32_t> columns_from(NumberReader reader, size_t frames, size_t columns, int order) {
  std::vector<int32_t> values(frames * columns);
  for (size_t column = 0; column < columns; ++column) {
    read_differences(&reader, frames, columns, order, values.data() + column);
  }
  PICTURA_CHECK(reader.is_at_end(), "expected {} numbers, got more", frames * columns);
  return values;
}

constexpr int kLightOrder = 1, kDecisionOrder = 1, kFollowedOrder = 1;
constexpr int64_t kMaxGroupBytes = int64_t{1} << 31;  // maximum size of decompressed images
constexpr int32_t kMaxImage_px = 8192;                // maximum width and height, as for the cameras of a rig

struct Section {
  std::string name;
  std::string bytes;
};

std::vector<Section> sections_of(const Replay& replay) {
  std::vector<Section> sections{{"map", map_bytes(replay.map)},
                                {"scenery", scenery_bytes(replay.scenery)},
                                {"episodes", episode_bytes(replay.episodes)},
                                {"conditioning", conditioning_bytes(replay.episodes)}};
  const size_t frames = size(replay.num_frames);
  const std::vector<int32_t> lights(replay.lights.begin(), replay.lights.end());
  sections.push_back({"lights", column_bytes(lights.data(), frames, size(replay.num_lights), kLightOrder)});
  for (size_t i = 0; i < kNumTracks; ++i) {
    sections.push_back({std::string(kTracks[i].name),
                        column_bytes(replay.tracks[i].data(), frames, size(replay.num_agents), kTracks[i].order)});
  }
  if (!replay.decisions.empty()) {
    sections.push_back({"decisions", column_bytes(replay.decisions.data(), frames, kDecisionValues, kDecisionOrder)});
  }
  if (!replay.followed_agents.empty()) {
    sections.push_back({"followed", column_bytes(replay.followed_agents.data(), frames, 1, kFollowedOrder)});
  }
  return sections;
}

/// Returns the first groups of images, as many as fit into a file.
Span<const std::string> written_groups(const ReplayImages& images) {
  size_t count = 0, bytes = 0;
  while (count < images.groups.size() && bytes + images.groups[count].size() <= kMaxWrittenImageBytes) {
    bytes += images.groups[count++].size();
  }
  return {images.groups.data(), count};
}

Json case_json(const ReplayCase& probed) {
  Json inserted = nullptr, answers = Json::array();
  if (probed.inserted) {
    const ReplayBox& box = *probed.inserted;
    inserted = {{"class", static_cast<int>(box.body.agent_class)},
                {"length_cm", box.body.length_cm},
                {"width_cm", box.body.width_cm},
                {"height_cm", box.body.height_cm},
                {"x_cm", box.x_cm},
                {"y_cm", box.y_cm},
                {"z_cm", box.z_cm},
                {"heading_ddeg", box.heading_ddeg},
                {"path_cm", probed.path_cm}};
  }
  for (const ReplayResponse& answer : probed.answers) {
    answers.push_back({{"policy", answer.policy},
                       {"value", answer.value},
                       {"value_without", answer.value_without},
                       {"brake", answer.brake},
                       {"brake_without", answer.brake_without}});
  }
  return {{"what", probed.what},  {"frame", probed.frame},
          {"ego", probed.ego},    {"removed", probed.removed < 0 ? Json(nullptr) : Json(probed.removed)},
          {"inserted", inserted}, {"answers", answers}};
}

ReplayCase case_from(const Json& json, const Replay& replay) {
  ReplayCase probed;
  json.at("what").get_to(probed.what);
  json.at("frame").get_to(probed.frame);
  json.at("ego").get_to(probed.ego);
  PICTURA_CHECK(probed.frame >= 0 && probed.frame < replay.num_frames,
                "header: case: expected a frame below {}, got {}", replay.num_frames, probed.frame);
  if (!json.at("removed").is_null()) probed.removed = json.at("removed").get<int32_t>();
  for (const int32_t agent : {probed.ego, std::max(0, probed.removed)}) {
    PICTURA_CHECK(agent >= 0 && agent < replay.num_agents, "header: case: expected an agent below {}, got {}",
                  replay.num_agents, agent);
  }
  if (const Json& box = json.at("inserted"); !box.is_null()) {
    ReplayBox& inserted = probed.inserted.emplace();
    inserted.body.agent_class = class_from("header: case", box.at("class").get<int32_t>());
    for (const auto& [name, value] : {std::pair{"length_cm", &inserted.body.length_cm},
                                      {"width_cm", &inserted.body.width_cm},
                                      {"height_cm", &inserted.body.height_cm},
                                      {"x_cm", &inserted.x_cm},
                                      {"y_cm", &inserted.y_cm},
                                      {"z_cm", &inserted.z_cm},
                                      {"heading_ddeg", &inserted.heading_ddeg}}) {
      box.at(name).get_to(*value);
    }
    box.at("path_cm").get_to(probed.path_cm);
  }
  for (const Json& answer : json.at("answers")) {
    probed.answers.push_back({answer.at("policy").get<std::string>(), answer.at("value").get<double>(),
                              answer.at("value_without").get<double>(), answer.at("brake").get<double>(),
                              answer.at("brake_without").get<double>()});
  }
  return probed;
}

// List of the numeric members of a camera, as X(name).
#define PICTURA_REPLAY_CAMERA(X) \
  X(width_px)                    \
  X(height_px)                   \
  X(focal_x_px)                  \
  X(focal_y_px)                  \
  X(center_x_px)                 \
  X(center_y_px)                 \
  X(x_m)                         \
  X(y_m)                         \
  X(z_m)                         \
  X(yaw_rad)                     \
  X(pitch_rad)                   \
  X(roll_rad)

Json camera_json(const ReplayCamera& camera) {
  Json json{{"name", camera.name}};
#define X(value) json[#value] = camera.value;
  PICTURA_REPLAY_CAMERA(X)
#undef X
  return json;
}

ReplayCamera camera_from(const Json& json) {
  ReplayCamera camera{.name = json.at("name").get<std::string>()};
#define X(value) json.at(#value).get_to(camera.value);
  PICTURA_REPLAY_CAMERA(X)
#undef X
  for (const int32_t size_px : {camera.width_px, camera.height_px}) {
    PICTURA_CHECK(size_px >= 1 && size_px <= kMaxImage_px, "header: cameras: expected sizes of 1 to {}, got {}",
                  kMaxImage_px, size_px);
  }
  return camera;
}

Json header_of(const Replay& replay, const std::vector<Section>& sections) {
  const ReplayOrigin& origin = replay.origin;
  Json metrics;
#define X(name) metrics[#name] = replay.metrics.name;
  PICTURA_REPLAY_METRICS(X)
#undef X
  Json first_infraction = nullptr;
  if (replay.first_infraction.frame >= 0) {
    first_infraction = {{"frame", replay.first_infraction.frame}, {"agent", replay.first_infraction.agent}};
  }
  Json tracks = Json::array();
  for (const TrackInfo& track : kTracks) {
    tracks.push_back({{"name", track.name}, {"unit", track.unit}, {"order", track.order}});
  }
  Json list = Json::array();
  for (const Section& section : sections) list.push_back({{"name", section.name}, {"bytes", section.bytes.size()}});
  Json images = nullptr;
  if (const Span<const std::string> groups = written_groups(replay.images); !groups.empty()) {
    images = {
        {"frames_per_group", replay.images.frames_per_group}, {"hues", replay_hues()}, {"group_bytes", Json::array()}};
    for (const std::string& group : groups) images["group_bytes"].push_back(group.size());
  }
  Json cameras = Json::array(), classes = Json::array(), light_hues = Json::array();
  for (const ReplayCamera& camera : replay.cameras) cameras.push_back(camera_json(camera));
  for (int number = 0; number < kNumAgentClasses; ++number) {
    const auto agent_class = static_cast<AgentClass>(number);
    Json hues = Json::array();
    for (int face = 0; face < kNumBoxFaces; ++face) {
      hues.push_back(replay_hue(agent_color(agent_class, static_cast<BoxFace>(face))));
    }
    classes.push_back({{"reference_to_center", reference_to_center(agent_class, 1.0f)}, {"hues", hues}});
  }
  for (int state = 0; state < kNumLightStates; ++state) {
    light_hues.push_back(replay_hue(light_color(static_cast<LightState>(state))));
  }
  return {{"format", kFormat},
          {"version", kReplayVersion},
          {"command", origin.command},
          {"program", origin.version},
          {"commit", origin.commit},
          {"map", origin.map},
          {"map_hash", origin.map_hash},
          {"origin_m", origin.map_origin_m},
          {"policy", origin.policy},
          {"policy_hash", origin.policy_hash},
          {"light_cycles", origin.light_cycles},
          {"seed", fmt::format("{}", origin.seed)},  // as text, because JSON readers may use doubles
          {"global_world", origin.global_world},
          {"dt_s", origin.dt_s},
          {"agents", replay.num_agents},
          {"frames", replay.num_frames},
          {"lights", replay.num_lights},
          {"followed", replay.followed},
          {"metrics", metrics},
          {"first_infraction", first_infraction},
          {"case", replay.probed ? case_json(*replay.probed) : Json(nullptr)},
          {"conditioning", kConditioningNames},
          {"decision_unit", kDecisionUnit},
          {"tracks", tracks},
          {"sections", list},
          {"cameras", cameras},
          {"line_floor_px", replay.line_floor_px},
          {"classes", classes},
          {"light_hues", light_hues},
          {"images", images}};
}

// Returns the text between the start tag and the end tag of an element.
std::string_view element(std::string_view page, std::string_view begin, const char* what) {
  const size_t at = page.find(begin);
  PICTURA_CHECK(at != std::string_view::npos, "expected a page of pictura replay, got a file without {}", what);
  const size_t first = at + begin.size(), end = page.find(kEnd, first);
  PICTURA_CHECK(end != std::string_view::npos, "ends within {}", what);
  return page.substr(first, end - first);
}

Json header_from(std::string_view page) {
  Json header = parse_json(element(page, kHeaderBegin, "a replay's header"));
  PICTURA_CHECK(header.value("format", "") == kFormat, "expected a replay's header");
  const int version = header.at("version").get<int>();
  PICTURA_CHECK(version == kReplayVersion, "expected a replay of version {}, got version {}", kReplayVersion, version);
  return header;
}

void check_header(const Replay& replay) {
  for (const auto& [what, value] :
       {std::pair{"agents", replay.num_agents}, {"frames", replay.num_frames}, {"lights", replay.num_lights}}) {
    PICTURA_CHECK(value >= 0 && value <= 1 << 24, "header: {}: expected at most {}, got {}", what, 1 << 24, value);
  }
  const int64_t numbers = int64_t{replay.num_frames} * replay.num_agents;
  PICTURA_CHECK(numbers <= kMaxReplayNumbers / int64_t{kNumTracks},
                "header: expected agents times frames of at most {}, got {}", kMaxReplayNumbers / int64_t{kNumTracks},
                numbers);
  const int64_t lights = int64_t{replay.num_frames} * replay.num_lights;
  PICTURA_CHECK(lights <= kMaxReplayNumbers, "header: expected lights times frames of at most {}, got {}",
                kMaxReplayNumbers, lights);
  PICTURA_CHECK(replay.followed >= -1 && replay.followed < replay.num_agents,
                "header: followed: expected an agent below {}, got {}", replay.num_agents, replay.followed);
}

void read_header_values(const Json& header, Replay* replay_out) {
  ReplayOrigin& origin = replay_out->origin;
  header.at("command").get_to(origin.command);
  header.at("program").get_to(origin.version);
  header.at("commit").get_to(origin.commit);
  header.at("map").get_to(origin.map);
  header.at("map_hash").get_to(origin.map_hash);
  origin.map_origin_m = header.value("origin_m", std::array<double, 3>{});
  header.at("policy").get_to(origin.policy);
  header.at("policy_hash").get_to(origin.policy_hash);
  origin.light_cycles = header.value("light_cycles", "");
  const std::optional<uint64_t> seed = parse_unsigned(header.at("seed").get<std::string>());
  PICTURA_CHECK(seed, "header: seed: expected a number, got {}", header.at("seed").dump());
  origin.seed = *seed;
  header.at("global_world").get_to(origin.global_world);
  header.at("dt_s").get_to(origin.dt_s);
  header.at("agents").get_to(replay_out->num_agents);
  header.at("frames").get_to(replay_out->num_frames);
  header.at("lights").get_to(replay_out->num_lights);
  header.at("followed").get_to(replay_out->followed);
#define X(name) header.at("metrics").at(#name).get_to(replay_out->metrics.name);
  PICTURA_REPLAY_METRICS(X)
#undef X
  const Json& first = header.at("first_infraction");
  if (!first.is_null()) {
    first.at("frame").get_to(replay_out->first_infraction.frame);
    first.at("agent").get_to(replay_out->first_infraction.agent);
  }
  check_header(*replay_out);
  if (const Json& probed = header.at("case"); !probed.is_null()) replay_out->probed = case_from(probed, *replay_out);
  for (const Json& camera : header.at("cameras")) replay_out->cameras.push_back(camera_from(camera));
  header.at("line_floor_px").get_to(replay_out->line_floor_px);
}

// Throws Error unless each frame belongs to one episode, and each light has a shape with its points.
void check_contents(const Replay& replay) {
  int32_t frames = 0;
  for (const ReplayEpisode& episode : replay.episodes) {
    PICTURA_CHECK(
        episode.first_frame == frames && episode.num_frames > 0 && episode.num_frames <= replay.num_frames - frames,
        "episodes: expected an episode of frames {} to at most {}, got {} frames from {} on", frames,
        replay.num_frames - 1, episode.num_frames, episode.first_frame);
    frames += episode.num_frames;
  }
  PICTURA_CHECK(frames == replay.num_frames, "episodes: expected {} frames, got {}", replay.num_frames, frames);
  int32_t lights = 0;
  for (const ReplayShape& shape : replay.map) {
    if (shape.kind != ShapeKind::light) continue;
    ++lights;
    PICTURA_CHECK(shape.points_cm.size() == kLightPoints, "map: expected a light of {} points, got {}", kLightPoints,
                  shape.points_cm.size());
  }
  PICTURA_CHECK(lights == replay.num_lights, "map: expected {} lights, got {}", replay.num_lights, lights);
  for (const int32_t agent : replay.followed_agents) {
    PICTURA_CHECK(agent >= 0 && agent < replay.num_agents, "followed: expected an agent of 0 to {}, got {}",
                  replay.num_agents - 1, agent);
  }
}

void read_images(const Json& header, std::string_view page, Replay* replay_inout) {
  const Json& images = header.at("images");
  if (images.is_null()) return;
  ReplayImages* images_out = &replay_inout->images;
  const auto per_group = images.at("frames_per_group").get<int64_t>();
  const auto frame_bytes = static_cast<int64_t>(bytes_of_frame(replay_inout->cameras));
  const int64_t most = kMaxGroupBytes / std::max<int64_t>(1, frame_bytes);
  PICTURA_CHECK(per_group >= 1 && per_group <= most,
                "header: images: frames_per_group: expected 1 to {} frames of {} bytes, got {}", most, frame_bytes,
                per_group);
  images_out->frames_per_group = static_cast<int32_t>(per_group);
  const std::string bytes = from_base64(element(page, kImagesBegin, "a replay's images"));
  size_t at = 0;
  for (const Json& group : images.at("group_bytes")) {
    const auto count = group.get<size_t>();
    PICTURA_CHECK(count <= bytes.size() - at, "images: expected {} bytes more, got {}", count, bytes.size() - at);
    images_out->groups.push_back(bytes.substr(at, count));
    at += count;
  }
}

Replay replay_from(std::string_view page) {
  const Json header = header_from(page);
  Replay replay;
  read_header_values(header, &replay);
  size_t total = 0;
  for (const Json& section : header.at("sections")) total += section.at("bytes").get<size_t>();
  const std::string bytes = inflate(from_base64(element(page, kDataBegin, "a replay's numbers")), total);
  const size_t frames = size(replay.num_frames);
  size_t at = 0;
  std::set<std::string, std::less<>> names;
  for (const Json& entry : header.at("sections")) {
    const auto name = entry.at("name").get<std::string>();
    const std::string_view section = std::string_view(bytes).substr(at, entry.at("bytes").get<size_t>());
    at += section.size();
    names.insert(name);
    const NumberReader reader(section);
    if (name == "map") {
      replay.map = map_from(reader);
    } else if (name == "scenery") {
      replay.scenery = scenery_from(reader);
    } else if (name == "episodes") {
      replay.episodes = episodes_from(reader, replay.num_agents);
    } else if (name == "conditioning") {
      conditioning_from(section, replay.num_agents, &replay.episodes);
    } else if (name == "lights") {
      const std::vector<int32_t> lights = columns_from(reader, frames, size(replay.num_lights), kLightOrder);
      replay.lights.assign(lights.begin(), lights.end());
    } else if (name == "decisions") {
      replay.decisions = columns_from(reader, frames, kDecisionValues, kDecisionOrder);
    } else if (name == "followed") {
      replay.followed_agents = columns_from(reader, frames, 1, kFollowedOrder);
    } else {
      const auto* track =
          std::find_if(kTracks.begin(), kTracks.end(), [&](const TrackInfo& t) { return t.name == name; });
      PICTURA_CHECK(track != kTracks.end(), "header: sections: unknown section '{}'", name);
      replay.tracks[track - kTracks.begin()] = columns_from(reader, frames, size(replay.num_agents), track->order);
    }
  }
  const auto require = [&names](std::string_view name) {
    PICTURA_CHECK(names.contains(name), "header: expected a section '{}'", name);
  };
  for (const char* name : {"map", "scenery", "episodes", "conditioning", "lights"}) require(name);
  for (const TrackInfo& track : kTracks) require(track.name);
  check_contents(replay);
  read_images(header, page, &replay);
  return replay;
}

// Returns the result of `read` for a page. Adds the file's name to errors.
template <typename Read>
auto of_page(const std::string& path, Read&& read) {
  const std::string page = read_file(path);
  try {
    return read(std::string_view(page));
  } catch (const Json::exception&) {
    fail("{}: expected a replay's header, got damaged JSON, or JSON with a missing value", path);
  } catch (const Error& error) {
    fail("{}: {}", path, error.what());
  }
}

}  // namespace

ReplayText replay_text(const Replay& replay) {
  const std::vector<Section> sections = sections_of(replay);
  std::string bytes;
  for (const Section& section : sections) bytes += section.bytes;
  return {header_of(replay, sections), base64(deflate(bytes))};
}

void write_replay(const std::string& path, const Replay& replay) {
  const ReplayText text = replay_text(replay);
  std::string images;
  for (const std::string& group : written_groups(replay.images)) images += group;
  std::string elements;
  elements += fmt::format("{}{}{}\n", kHeaderBegin, script_text(text.header), kEnd);
  elements += fmt::format("{}{}{}\n", kDataBegin, text.data, kEnd);
  if (!images.empty()) elements += fmt::format("{}{}{}\n", kImagesBegin, base64(images), kEnd);
  const std::string title = fmt::format("{}, {}, seed {}", replay.origin.map, replay.origin.policy, replay.origin.seed);
  write_file(path, fill_template(page::replay_html(), {{"title", html_text(title)}, {"elements", elements}}));
}

Replay read_replay(const std::string& path) { return of_page(path, replay_from); }

nlohmann::ordered_json read_replay_header(const std::string& path) { return of_page(path, header_from); }

}  // namespace pictura
