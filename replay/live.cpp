#include "pictura/replay/live.h"

#include <algorithm>
#include <array>

#include "pictura/common/error.h"
#include "pictura/common/support/json.h"
#include "pictura/replay/encoding.h"
#include "pictura/replay/file.h"

namespace pictura {

namespace {

LiveJson body_json(const ReplayBody& body) {
  return {static_cast<int>(body.agent_class), body.length_cm, body.width_cm, body.height_cm};
}

LiveJson episode_json(const ReplayEpisode& episode) {
  LiveJson bodies = LiveJson::array(), parked = LiveJson::array();
  for (const ReplayBody& body : episode.agents) bodies.push_back(body_json(body));
  for (const ReplayBox& car : episode.parked) {
    LiveJson values = body_json(car.body);
    for (const int32_t value : {car.x_cm, car.y_cm, car.z_cm, car.heading_ddeg}) values.push_back(value);
    parked.push_back(values);
  }
  return {{"index", episode.index}, {"bodies", bodies}, {"parked", parked}, {"conditioning", episode.conditioning}};
}

constexpr std::array<std::pair<std::string_view, bool DrivingKeys::*>, 5> kKeys{{{"forward", &DrivingKeys::forward},
                                                                                 {"backward", &DrivingKeys::backward},
                                                                                 {"stop", &DrivingKeys::stop},
                                                                                 {"left", &DrivingKeys::left},
                                                                                 {"right", &DrivingKeys::right}}};

template <typename Number>
Number number_in(const std::string& name, const LiveJson& value, Number least, Number most) {
  const bool fits = std::is_integral_v<Number> ? value.is_number_integer() : value.is_number();
  // The comparison uses doubles, which represent every number of the range.
  PICTURA_CHECK(
      fits && value.get<double>() >= static_cast<double>(least) && value.get<double>() <= static_cast<double>(most),
      "{}: expected a number of {} to {}, got {}", name, least, most, value.dump());
  return value.get<Number>();
}

DrivingKeys keys_from(const LiveJson& names) {
  PICTURA_CHECK(names.is_array() && names.size() <= kKeys.size(), "keys: expected at most {} names, got {}",
                kKeys.size(), names.dump());
  DrivingKeys keys;
  for (const LiveJson& name : names) {
    const auto* key =
        std::find_if(kKeys.begin(), kKeys.end(), [&name](const auto& known) { return name == known.first; });
    PICTURA_CHECK(key != kKeys.end(), "keys: expected forward, backward, stop, left or right, got {}", name.dump());
    keys.*(key->second) = true;
  }
  return keys;
}

}  // namespace

LiveWorld::LiveWorld(Simulator& simulator, ReplayOrigin origin, const RendererConfig& cameras, bool sends_images)
    : recorder_(simulator, {.cameras = cameras}) {
  recorder_.set_origin(std::move(origin));
  if (sends_images) cameras_ = std::make_unique<AgentCameras>(simulator, cameras);
}

void LiveWorld::after_step(const StepResult& result) {
  const size_t num_episodes = recorder_.recorded().episodes.size();
  recorder_.after_step(result);
  keep_newest(num_episodes);
}

void LiveWorld::after_reset(Span<const uint8_t> world_mask) {
  const size_t num_episodes = recorder_.recorded().episodes.size();
  recorder_.after_reset(world_mask);
  if (world_mask.empty() || world_mask[0]) keep_newest(num_episodes);
}

void LiveWorld::keep_newest(size_t num_episodes) {
  begins_episode_ = recorder_.recorded().episodes.size() > num_episodes;
  entered_ = recorder_.discard_history();
  ++step_;  // number of the frame, as pages count
}

LiveJson LiveWorld::begin() const {
  ReplayText text = replay_text(recorder_.recorded());
  return {{"step", step_},
          {"header", std::move(text.header)},
          {"data", std::move(text.data)},
          {"images", cameras_ != nullptr}};
}

LiveJson LiveWorld::frame() const {
  const Replay& replay = recorder_.recorded();
  const ReplayEpisode& episode = replay.episodes.back();
  LiveJson chains = LiveJson::array(), entered = LiveJson::array(), metrics;
  for (const ReplayChain& chain : episode.chains) {
    LiveJson values{chain.agent};
    for (const auto* places : {&chain.x_cm, &chain.y_cm, &chain.z_cm}) {
      for (const int32_t value : *places) values.push_back(value);
    }
    chains.push_back(values);
  }
  for (const int32_t agent : entered_) {
    LiveJson values = body_json(episode.agents[agent]);
    values.insert(values.begin(), agent);
    const float* conditioning = episode.conditioning.data() + int64_t{agent} * kNumConditioning;
    for (size_t i = 0; i < kNumConditioning; ++i) values.push_back(conditioning[i]);
    entered.push_back(values);
  }
#define X(name) metrics[#name] = replay.metrics.name;
  PICTURA_REPLAY_METRICS(X)
#undef X
  return {{"step", step_},
          {"tracks", replay.tracks},
          {"lights", replay.lights},
          {"chains", chains},
          {"episode", begins_episode_ ? episode_json(episode) : LiveJson(nullptr)},
          {"entered", entered},
          {"metrics", metrics}};
}

LiveJson LiveWorld::agent_message(const std::optional<ReplayDecision>& decision, int agent) {
  LiveJson made = nullptr;
  if (decision) made = {{"probabilities", decision->probabilities}, {"value", decision->value}};
  return {{"step", step_},
          {"agent", agent},
          {"decision", made},
          {"images", cameras_ ? LiveJson(base64(cameras_->draw(agent))) : LiveJson(nullptr)}};
}

LiveRequest parse_live_request(std::string_view text, int num_agents) {
  LiveJson asked;
  try {
    asked = parse_json(text);
  } catch (const LiveJson::exception&) {  // thrown also for a number beyond the range of doubles
    fail("expected JSON");
  }
  PICTURA_CHECK(asked.is_object(), "expected an object of JSON, got {}", asked.type_name());
  LiveRequest request;
  for (const auto& [name, value] : asked.items()) {
    if (name == "paused") {
      PICTURA_CHECK(value.is_boolean(), "paused: expected true or false, got {}", value.dump());
      request.paused = value.get<bool>();
    } else if (name == "steps") {
      request.steps = number_in(name, value, 1, kMaxLiveSteps);
    } else if (name == "pace") {
      request.pace = number_in(name, value, kMinLivePace, kMaxLivePace);
    } else if (name == "watch") {
      request.watched = number_in(name, value, 0, num_agents - 1);
    } else if (name == "drive") {
      request.driven = number_in(name, value, -1, num_agents - 1);
    } else if (name == "keys") {
      request.keys = keys_from(value);
    } else {
      fail("expected paused, steps, pace, watch, drive or keys, got {}", LiveJson(name).dump());
    }
  }
  return request;
}

}  // namespace pictura
