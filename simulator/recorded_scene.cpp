#include "pictura/simulator/recorded_scene.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "pictura/common/error.h"
#include "pictura/simulator/hash_values.h"
#include "pictura/simulator/rules/limits.h"

namespace pictura {
namespace {

/// Returns the class of a track. All tracks except those of pedestrians and cyclists become vehicles.
AgentClass class_of(TrackType type) {
  switch (type) {
    case TrackType::pedestrian: return AgentClass::pedestrian;
    case TrackType::cyclist: return AgentClass::cyclist;
    default: return AgentClass::vehicle;
  }
}

/// Converts a recorded state, whose position is the box's centre, to the state of the agent's reference point.
RecordedState recorded_state(const RecordedTrack& track, const TrackState& state) {
  const SinCos heading = sincos_of(state.heading_rad);
  const float ahead_m = reference_to_center(class_of(track.type), track.length_m);
  return {{state.position_m.x - ahead_m * heading.cos, state.position_m.y - ahead_m * heading.sin, state.position_m.z},
          state.heading_rad,
          state.velocity_mps.x * heading.cos + state.velocity_mps.y * heading.sin,
          1};
}

/// Returns the state of a track at a step. The track must be valid at this step.
RecordedState recorded_state(const Scenario& scenario, size_t track, size_t step) {
  const size_t at = track * static_cast<size_t>(scenario.num_steps) + step;
  if (scenario.driven.empty()) return recorded_state(scenario.tracks[track], scenario.states[at]);
  const SavedMotion& driven = scenario.driven[at];
  return {driven.reference_m, scenario.states[at].heading_rad, driven.speed_mps, 1};
}

MapRecord record_of(const Scenario& scenario, int32_t start_step) {
  constexpr float kMaxRecordedRadius_m = 25.0f;  // contact with barriers is tested within this radius
  MapRecord record{.num_steps = scenario.num_steps - start_step, .dt_s = scenario.dt_s};
  for (size_t i = 0; i < scenario.tracks.size(); ++i) {
    const RecordedTrack& track = scenario.tracks[i];
    PICTURA_CHECK(std::hypot(track.length_m, track.width_m) <= 2 * kMaxRecordedRadius_m,
                  "scene {}: track {} (id {}): expected a box of at most {} m from corner to corner, got {} m by {} m",
                  scenario.id, i, track.id, 2 * kMaxRecordedRadius_m, track.length_m, track.width_m);
    const Span<const uint8_t> valid = scenario.valid_of(static_cast<int32_t>(i));
    const RecordedState last = recorded_state(scenario, i, static_cast<size_t>(track.last_valid));
    record.agents.push_back(
        {static_cast<int32_t>(class_of(track.type)), track.length_m, track.width_m, track.height_m, last.position_m});
    for (auto step = static_cast<size_t>(start_step); step < valid.size(); ++step) {
      record.states.push_back(valid[step] ? recorded_state(scenario, i, step) : RecordedState{});
    }
  }
  return record;
}

/// Converts a recorded light state. A flashing red light is not red, because traffic may proceed after stopping.
LightState light_state(RecordedLightState state) {
  switch (state) {
    case RecordedLightState::stop:
    case RecordedLightState::arrow_stop: return LightState::red;
    case RecordedLightState::caution:
    case RecordedLightState::arrow_caution:
    case RecordedLightState::flashing_stop:
    case RecordedLightState::flashing_caution: return LightState::yellow;
    case RecordedLightState::go:
    case RecordedLightState::arrow_go: return LightState::green;
    case RecordedLightState::none: break;
  }
  return LightState::unknown;
}

std::vector<LightState> light_states_of(const Scenario& scenario, int32_t start_step) {
  std::vector<LightState> states;
  for (int32_t light = 0; light < static_cast<int32_t>(scenario.lights.size()); ++light) {
    for (const RecordedLightState state :
         scenario.states_of_light(light).subspan(start_step, scenario.num_steps - start_step)) {
      states.push_back(light_state(state));
    }
  }
  return states;
}

/// Returns the scene's road map with the recorded lights added.
std::shared_ptr<const RoadMap> road_with_lights(const Scenario& scenario) {
  PICTURA_CHECK(scenario.map.lights.empty(),
                "scene {}: expected a map without its own lights, since recorded lights are added", scenario.id);
  auto road = std::make_shared<RoadMap>(scenario.map);
  for (const RecordedLight& recorded : scenario.lights) {
    const SinCos heading = sincos_of(recorded.stop_heading_rad);
    TrafficLight light{.stop_a_m = recorded.stop_a_m,
                       .stop_b_m = recorded.stop_b_m,
                       .stop_heading_rad = recorded.stop_heading_rad,
                       .head_facing = {-heading.cos, -heading.sin},
                       .lanes = recorded.lanes};
    light.head_m = (light.stop_a_m + light.stop_b_m) * 0.5f +
                   Vec3{kRecordedHeadAhead_m * heading.cos, kRecordedHeadAhead_m * heading.sin, kRecordedHeadHeight_m};
    road->lights.push_back(light);
  }
  road->light_lanes = scenario.light_lanes;
  return road;
}

/// Returns the tracks that one word selects; see tracks_selected_by().
std::vector<uint8_t> tracks_selected_by_word(const Scenario& scenario, const std::string& word) {
  std::vector<uint8_t> mask(scenario.tracks.size());
  const auto choose = [&](auto&& is_chosen) {
    for (size_t i = 0; i < mask.size(); ++i) mask[i] = is_chosen(static_cast<int32_t>(i), scenario.tracks[i]);
  };
  if (word == "self" || word == "sdc") {
    choose([&](int32_t i, const RecordedTrack&) { return i == scenario.sdc_track; });
  } else if (word == "vehicles") {
    choose([&](int32_t i, const RecordedTrack& track) {
      return i != scenario.sdc_track && track.type == TrackType::vehicle;
    });
  } else if (word == "others") {
    choose([&](int32_t i, const RecordedTrack& track) {
      return i != scenario.sdc_track && track.type != TrackType::vehicle;
    });
  } else if (word == "all") {
    choose([](int32_t, const RecordedTrack&) { return true; });
  } else if (word == "tracks_to_predict") {
    for (const PredictedTrack& predicted : scenario.tracks_to_predict) mask[predicted.track] = 1;
  } else if (word == "objects_of_interest") {
    for (const int32_t track : scenario.objects_of_interest) mask[track] = 1;
  } else {
    int64_t id = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), id);
    if (error != std::errc() || end != word.data() + word.size()) {
      fail_usage(
          "expected self (or sdc), vehicles, others, all, tracks_to_predict, objects_of_interest or the id of a track, "
          "got '{}'",
          word);
    }
    choose([id](int32_t, const RecordedTrack& track) { return track.id == id; });
  }
  return mask;
}

/// Calls visit(word, mask of the selected tracks) for each word.
template <typename Visit>
void visit_words(const Scenario& scenario, const std::string& words, Visit&& visit) {
  for (size_t begin = 0; begin <= words.size();) {
    const size_t end = std::min(words.find(',', begin), words.size());
    const std::string word = words.substr(begin, end - begin);
    visit(word, tracks_selected_by_word(scenario, word));
    begin = end + 1;
  }
}

bool selects_none(const std::vector<uint8_t>& mask) { return std::find(mask.begin(), mask.end(), 1) == mask.end(); }

}  // namespace

std::shared_ptr<const CompiledMap> compile_scenario(std::shared_ptr<const Scenario> scenario, const MapOptions& options,
                                                    int32_t start_step) {
  if (!scenario) fail_usage("simulator: expected a scene, got a null pointer");
  if (start_step < 0 || start_step >= scenario->num_steps) {
    fail_usage("scene {}: expected a start step in [0, {}), got {}", scenario->id, scenario->num_steps, start_step);
  }
  PICTURA_CHECK(scenario->tracks.size() <= kMaxAgentsPerWorld, "scene {}: expected at most {} tracks, got {}",
                scenario->id, kMaxAgentsPerWorld, scenario->tracks.size());
  std::shared_ptr<const RoadMap> road(scenario, &scenario->map);
  MapRecord record = record_of(*scenario, start_step);
  if (options.recorded_lights) {
    road = road_with_lights(*scenario);
    record.light_states = light_states_of(*scenario, start_step);
  }
  const std::shared_ptr<CompiledMap> map = compile_map(std::move(road), options, std::move(record));
  map->scenario = std::move(scenario);
  map->start_step = start_step;
  return map;
}

std::shared_ptr<const CompiledMap> with_tracks(const CompiledMap& map, Span<const int32_t> driven,
                                               Span<const int32_t> replayed, int num_agents) {
  const auto first_replayed = static_cast<size_t>(num_agents);
  if (driven.empty() || driven.size() > first_replayed) {
    fail_usage("scene {}: expected 1 to {} driven tracks, got {}", map.scenario->id, num_agents, driven.size());
  }
  auto result = std::make_shared<CompiledMap>(map);
  const MapRecord& from = map.rules.record;
  MapRecord& to = result->rules.record;
  const auto steps = static_cast<size_t>(from.num_steps);
  to.first_replayed = num_agents;
  to.agents.assign(first_replayed + replayed.size(), {});
  to.states.assign(to.agents.size() * steps, {});
  const auto take = [&](Span<const int32_t> tracks, size_t first) {
    for (size_t i = 0; i < tracks.size(); ++i) {
      const auto track = static_cast<size_t>(tracks[i]);
      to.agents[first + i] = from.agents[track];
      std::copy_n(from.states.begin() + static_cast<ptrdiff_t>(track * steps), steps,
                  to.states.begin() + static_cast<ptrdiff_t>((first + i) * steps));
    }
  };
  take(driven, 0);
  take(replayed, first_replayed);
  Hash64 hash;
  add_values(&hash, map.fingerprint, num_agents, driven.size());
  hash.add(driven);
  hash.add(replayed);
  result->fingerprint = hash.value();
  return result;
}

SimulatorConfig scene_config(const Scenario& scenario, int32_t start_step, SimulatorConfig config) {
  config.dt_s = std::min(scenario.dt_s, kMaxStep_s);  // WOMD's steps are slightly longer
  config.episode_steps = std::max(1, scenario.num_steps - 1 - start_step);
  config.reset_inactive_fraction = 2;
  config.parked_cars = 0;
  config.walls = false;
  for (const Conditioning which : {Conditioning::throttle, Conditioning::steer, Conditioning::acceleration}) {
    config.conditioning[static_cast<size_t>(which)] = {1, 1};
  }
  return config;
}

WorldSpec scene_world(const CompiledMap& map, int index, uint32_t global_world) {
  return {index, static_cast<int>(map.rules.record.agents.size()), global_world};
}

std::vector<uint8_t> tracks_selected_by(const Scenario& scenario, const std::string& words) {
  std::vector<uint8_t> mask(scenario.tracks.size());
  visit_words(scenario, words, [&mask](const std::string&, const std::vector<uint8_t>& named) {
    for (size_t i = 0; i < mask.size(); ++i) mask[i] |= named[i];
  });
  return mask;
}

std::vector<uint8_t> tracks_of(const Scenario& scenario, const std::string& words) {
  visit_words(scenario, words, [&scenario](const std::string& word, const std::vector<uint8_t>& named) {
    if (!selects_none(named)) return;
    fail_usage("scene {}: expected tracks, got '{}', which selects none of its {}", scenario.id, word, named.size());
  });
  return tracks_selected_by(scenario, words);
}

std::vector<uint8_t> tracks_of(const Scenario& scenario, const std::string& words, int32_t step) {
  std::vector<uint8_t> mask = tracks_of(scenario, words);
  for (size_t i = 0; i < mask.size(); ++i) {
    mask[i] &= scenario.valid_of(static_cast<int32_t>(i))[step];
  }
  if (selects_none(mask)) {
    fail_usage("'{}': expected a track that is present at step {}, got none", words, step);
  }
  return mask;
}

std::optional<float> displacement_m(const Scenario& scenario, int32_t track, int32_t step, Vec3 center_m) {
  if (step >= scenario.num_steps || !scenario.valid_of(track)[step]) return std::nullopt;
  return length((center_m - scenario.states_of(track)[step].position_m).xy());
}

}  // namespace pictura
