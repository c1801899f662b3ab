#include "pictura/map/scenario/scenario.h"

#include <cmath>

#include "pictura/common/error.h"
#include "pictura/map/map_fields.h"
#include "pictura/map/scenario/scenario_fields.h"

namespace pictura {

namespace {

void check_track(const Scenario& scenario, int32_t index) {
  const RecordedTrack& track = scenario.tracks[index];
  for (const auto& [field, size_m] : {std::pair{"length_m", track.length_m}, std::pair{"width_m", track.width_m},
                                      std::pair{"height_m", track.height_m}}) {
    PICTURA_CHECK(size_m > 0 && size_m <= kMaxTrackSize_m, "track {}: {}: expected a number in (0, {}], got {}", index,
                  field, kMaxTrackSize_m, size_m);
  }
  const Span<const uint8_t> valid = scenario.valid_of(index);
  const Span<const TrackState> states = scenario.states_of(index);
  int32_t first = -1, last = -1, count = 0;
  for (int32_t step = 0; step < scenario.num_steps; ++step) {
    const TrackState& state = states[step];
    PICTURA_CHECK(valid[step] <= 1, "track {}: step {}: valid: expected 0 or 1, got {}", index, step, valid[step]);
    for (const float value : {state.position_m.x, state.position_m.y, state.position_m.z, state.heading_rad,
                              state.velocity_mps.x, state.velocity_mps.y}) {
      PICTURA_CHECK(std::isfinite(value) && std::abs(value) <= kMaxScenarioRadius_m,
                    "track {}: step {}: expected numbers of at most {} in magnitude, got {}", index, step,
                    kMaxScenarioRadius_m, value);
    }
    if (!scenario.driven.empty()) {
      const SavedMotion& driven =
          scenario.driven[static_cast<std::size_t>(index) * states.size() + static_cast<std::size_t>(step)];
      for (const float value : {driven.reference_m.x, driven.reference_m.y, driven.reference_m.z, driven.speed_mps}) {
        PICTURA_CHECK(std::isfinite(value) && std::abs(value) <= kMaxScenarioRadius_m,
                      "track {}: step {}: driven: expected numbers of at most {} in magnitude, got {}", index, step,
                      kMaxScenarioRadius_m, value);
      }
    }
    if (!valid[step]) continue;
    PICTURA_CHECK(std::abs(state.heading_rad) <= kPi + 1e-4f,
                  "track {}: step {}: heading_rad: expected a number in [-pi, pi], got {}", index, step,
                  state.heading_rad);
    if (first < 0) first = step;
    last = step;
    ++count;
  }
  PICTURA_CHECK(count > 0, "track {}: expected at least one valid state", index);
  PICTURA_CHECK(track.first_valid == first && track.last_valid == last && track.num_valid == count,
                "track {}: expected its {} valid states to be in [{}, {}], got {} in [{}, {}]", index, track.num_valid,
                track.first_valid, track.last_valid, count, first, last);
}

void check_index(const char* what, std::size_t item, int32_t index, std::size_t count, int32_t lowest = 0) {
  PICTURA_CHECK(index >= lowest && index < static_cast<int32_t>(count), "{} {}: expected an index in [{}, {}), got {}",
                what, item, lowest, count, index);
}

void check_lights(const Scenario& scenario) {
  for (std::size_t i = 0; i < scenario.lights.size(); ++i) {
    const RecordedLight& light = scenario.lights[i];
    for (const Vec3 p : {light.stop_a_m, light.stop_b_m}) {
      PICTURA_CHECK(std::abs(p.x) <= kMaxScenarioRadius_m && std::abs(p.y) <= kMaxScenarioRadius_m &&
                        std::abs(p.z) <= kMaxScenarioRadius_m,
                    "light {}: stop line: expected coordinates within {} m, got ({}, {}, {})", i, kMaxScenarioRadius_m,
                    p.x, p.y, p.z);
    }
    PICTURA_CHECK(std::abs(light.stop_heading_rad) <= kPi + 1e-4f,
                  "light {}: stop_heading_rad: expected a number in [-pi, pi], got {}", i, light.stop_heading_rad);
    PICTURA_CHECK(light.lanes.begin >= 0 && light.lanes.begin < light.lanes.end &&
                      light.lanes.end <= static_cast<int32_t>(scenario.light_lanes.size()),
                  "light {}: lanes: expected a range within [0, {}) that is not empty, got [{}, {})", i,
                  scenario.light_lanes.size(), light.lanes.begin, light.lanes.end);
  }
  for (std::size_t i = 0; i < scenario.light_lanes.size(); ++i) {
    check_index("light lane", i, scenario.light_lanes[i], scenario.map.lanes.size());
  }
  for (std::size_t i = 0; i < scenario.light_states.size(); ++i) {
    PICTURA_CHECK(scenario.light_states[i] <= RecordedLightState::flashing_caution,
                  "light state {}: no state has the number {}", i, static_cast<int>(scenario.light_states[i]));
  }
}

}  // namespace

const char* to_string(TrackType type) {
  switch (type) {
    case TrackType::unset: return "unset";
    case TrackType::vehicle: return "vehicle";
    case TrackType::pedestrian: return "pedestrian";
    case TrackType::cyclist: return "cyclist";
    case TrackType::other: return "other";
  }
  return "unknown";
}

const char* to_string(RecordedControl control) {
  switch (control) {
    case RecordedControl::unstated: return "unstated";
    case RecordedControl::controllable: return "controllable";
    case RecordedControl::expert: return "expert";
    case RecordedControl::still: return "still";
  }
  return "unknown";
}

const char* to_string(RecordedLightState state) {
  switch (state) {
    case RecordedLightState::none: return "none";
    case RecordedLightState::arrow_stop: return "arrow_stop";
    case RecordedLightState::arrow_caution: return "arrow_caution";
    case RecordedLightState::arrow_go: return "arrow_go";
    case RecordedLightState::stop: return "stop";
    case RecordedLightState::caution: return "caution";
    case RecordedLightState::go: return "go";
    case RecordedLightState::flashing_stop: return "flashing_stop";
    case RecordedLightState::flashing_caution: return "flashing_caution";
  }
  return "unknown";
}

void validate(const Scenario& scenario) {
  validate(scenario.map);
  try {
    PICTURA_CHECK(scenario.num_steps >= 1 && scenario.num_steps <= kMaxScenarioSteps,
                  "num_steps: expected 1 to {}, got {}", kMaxScenarioSteps, scenario.num_steps);
    PICTURA_CHECK(scenario.current_step >= 0 && scenario.current_step < scenario.num_steps,
                  "current_step: expected a step in [0, {}), got {}", scenario.num_steps, scenario.current_step);
    PICTURA_CHECK(scenario.dt_s > 1e-3f && scenario.dt_s < 10.0f,
                  "dt_s: expected more than 0.001 s and less than 10 s, got {}", scenario.dt_s);
    PICTURA_CHECK(scenario.tracks.size() <= kMaxScenarioTracks, "tracks: expected at most {}, got {}",
                  kMaxScenarioTracks, scenario.tracks.size());
    const std::size_t steps = static_cast<std::size_t>(scenario.num_steps);
    const auto check_size = [](const char* what, std::size_t size, std::size_t expected) {
      PICTURA_CHECK(size == expected, "{}: expected {} elements, got {}", what, expected, size);
    };
    check_size("states", scenario.states.size(), scenario.tracks.size() * steps);
    if (!scenario.driven.empty()) check_size("driven", scenario.driven.size(), scenario.tracks.size() * steps);
    check_size("valid", scenario.valid.size(), scenario.tracks.size() * steps);
    check_size("light_states", scenario.light_states.size(), scenario.lights.size() * steps);
    for (std::size_t i = 0; i < scenario.tracks.size(); ++i) check_track(scenario, static_cast<int32_t>(i));
    check_index("sdc_track", 0, scenario.sdc_track, scenario.tracks.size(), -1);
    for (std::size_t i = 0; i < scenario.objects_of_interest.size(); ++i) {
      check_index("object of interest", i, scenario.objects_of_interest[i], scenario.tracks.size());
    }
    for (std::size_t i = 0; i < scenario.tracks_to_predict.size(); ++i) {
      check_index("track to predict", i, scenario.tracks_to_predict[i].track, scenario.tracks.size());
    }
    check_lights(scenario);
  } catch (const Error& error) {
    fail("scenario {}: {}", scenario.id, error.what());
  }
}

std::string first_difference(const Scenario& a, const Scenario& b) { return difference_of(a, b); }

bool is_moving(const Scenario& scenario, int32_t track) {
  const RecordedTrack& summary = scenario.tracks[track];
  const Span<const TrackState> states = scenario.states_of(track);
  return length(states[summary.last_valid].position_m - states[summary.first_valid].position_m) >= kMovingTrack_m;
}

ScenarioFacts facts_of(const Scenario& scenario) {
  ScenarioFacts facts;
  for (std::size_t i = 0; i < scenario.tracks.size(); ++i) {
    const RecordedTrack& track = scenario.tracks[i];
    switch (track.type) {
      case TrackType::vehicle:
        ++facts.vehicles;
        facts.moving_vehicles += is_moving(scenario, static_cast<int32_t>(i)) ? 1 : 0;
        break;
      case TrackType::pedestrian: ++facts.pedestrians; break;
      case TrackType::cyclist: ++facts.cyclists; break;
      default: ++facts.others;
    }
    facts.tracks_with_gaps += track.num_valid < track.last_valid - track.first_valid + 1 ? 1 : 0;
  }
  for (const RecordedLightState state : scenario.light_states) {
    facts.recorded_light_states += state != RecordedLightState::none ? 1 : 0;
  }
  return facts;
}

}  // namespace pictura
