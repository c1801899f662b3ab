#include "pictura/simulator/scene_recorder.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "pictura/common/error.h"
#include "pictura/simulator/rules/limits.h"

namespace pictura {
namespace {

TrackType type_of(AgentClass agent_class) {
  switch (agent_class) {
    case AgentClass::pedestrian: return TrackType::pedestrian;
    case AgentClass::cyclist: return TrackType::cyclist;
    default: return TrackType::vehicle;
  }
}

RecordedLightState recorded_light(LightState state) {
  switch (state) {
    case LightState::red: return RecordedLightState::stop;
    case LightState::yellow: return RecordedLightState::caution;
    case LightState::green: return RecordedLightState::go;
    default: return RecordedLightState::none;
  }
}

/// Converts the lights of a map to recorded lights, because lights in recorded scenes have no cycles.
void move_lights(Scenario* scenario) {
  RoadMap& map = scenario->map;
  for (const TrafficLight& light : map.lights) {
    scenario->lights.push_back({light.stop_a_m, light.stop_b_m, light.stop_heading_rad, light.lanes});
  }
  scenario->light_lanes = std::move(map.light_lanes);
  map.lights.clear();
  map.light_lanes.clear();
  map.provenance.lights.clear();
  map.facts.traffic_lights = map.facts.stop_lines = map.facts.signal_junctions = 0;
}

/// Copies a recording's lights from start_step on. After the end of the recording, lights have no state.
void copy_lights(const Scenario& from, int32_t start_step, Scenario* to) {
  to->lights = from.lights;
  to->light_lanes = from.light_lanes;
  for (int32_t light = 0; light < static_cast<int32_t>(from.lights.size()); ++light) {
    for (int32_t step = start_step; step < start_step + to->num_steps; ++step) {
      to->light_states.push_back(step < from.num_steps ? from.states_of_light(light)[step] : RecordedLightState::none);
    }
  }
}

}  // namespace

SceneRecorder::SceneRecorder(Simulator& simulator, int world)
    : simulator_(simulator), world_(static_cast<size_t>(world)) {
  if (!simulator.device().is_host()) {
    fail_usage("scenes are recorded only from simulators on cpu, got a simulator on {}", name_of(simulator.device()));
  }
  if (world < 0 || world_ >= simulator.worlds().size()) {
    fail_usage("expected a world to record in [0, {}), got {}", simulator.worlds().size(), world);
  }
  spec_ = simulator.worlds()[world_];
  map_ = simulator.maps()[spec_.map];
  if (map_->rules.record.first_replayed > 0) {
    fail_usage("expected a world in which all tracks of a recorded scene are agents, got one with chosen tracks");
  }
  seed_ = simulator.arrays().seed[world_];
  first_slot_ = simulator.slots().slot_begin[world_];
  episode_ = simulator.episode_index()[world_];
  first_step_ = simulator.episode_step()[world_];
  const Span<const AgentBox> now = boxes();
  for (const AgentBox& box : now) bodies_.push_back({box});
  add_step();
}

Span<const AgentBox> SceneRecorder::boxes() const {
  const SceneBatch& scene = simulator_.scene();
  const auto begin = static_cast<size_t>(scene.world_begin[world_]);
  return scene.agents.subspan(begin, static_cast<size_t>(scene.world_begin[world_ + 1]) - begin);
}

void SceneRecorder::add_step() {
  const SceneBatch& scene = simulator_.scene();
  const AgentStateView state = simulator_.state();
  const Span<const AgentBox> now = boxes();
  for (size_t i = 0; i < now.size(); ++i) {
    const AgentBox& box = now[i];
    const bool is_agent = static_cast<int>(i) < spec_.num_agents;
    const auto slot = static_cast<size_t>(first_slot_) + i;
    valid_.push_back(box.drawn ? 1 : 0);
    life_.push_back(is_agent ? state.life[slot] : 0);
    states_.emplace_back();
    driven_.emplace_back();
    if (!box.drawn) continue;
    bodies_[i].resize(static_cast<size_t>(life_.back()) + 1, box);
    bodies_[i].back() = box;
    const float speed_mps = is_agent ? state.speed_mps[slot] : 0.0f;
    states_.back() = {box.center_m,
                      is_agent ? state.heading_rad[slot] : std::atan2(box.sin_heading, box.cos_heading),
                      {speed_mps * box.cos_heading, speed_mps * box.sin_heading}};
    const float ahead_m = reference_to_center(box.agent_class, box.length_m);
    const Vec3 behind_m{box.center_m.x - ahead_m * box.cos_heading, box.center_m.y - ahead_m * box.sin_heading,
                        box.center_m.z};
    driven_.back() = {is_agent ? Vec3{state.x_m[slot], state.y_m[slot], state.z_m[slot]} : behind_m, speed_mps};
  }
  for (int32_t i = scene.light_begin[world_]; i < scene.light_begin[world_ + 1]; ++i) {
    lights_.push_back(recorded_light(scene.light_states[i]));
  }
  ++num_steps_;
}

void SceneRecorder::after_step(const StepResult& /*result*/) { follow(); }

void SceneRecorder::after_reset(Span<const uint8_t> world_mask) {
  if (world_mask.empty() || world_mask[world_]) follow();
}

void SceneRecorder::follow() {
  is_over_ = is_over_ || simulator_.episode_index()[world_] != episode_ ||
             simulator_.episode_step()[world_] != first_step_ + num_steps_;
  if (is_over_) return;
  PICTURA_CHECK(num_steps_ < kMaxScenarioSteps, "expected a scene of at most {} steps, got more", kMaxScenarioSteps);
  add_step();
}

Scenario SceneRecorder::scenario(std::string id, int self_agent) const {
  const CompiledMap& map = *map_;
  Scenario scenario;
  scenario.format = "pictura";
  scenario.id = id.empty()
                    ? fmt::format("{} seed {} world {} episode {}", map.road->name, seed_, spec_.global_world, episode_)
                    : std::move(id);
  scenario.dt_s = simulator_.config().dt_s;
  scenario.num_steps = num_steps_;
  scenario.current_step = std::min(10, num_steps_ - 1);
  const Scenario* const recorded = map.scenario.get();  // recorded scene of the world's map, or null
  scenario.map = recorded ? recorded->map : *map.road;  // without recorded lights
  if (recorded && self_agent < 0) self_agent = recorded->sdc_track;
  const auto steps = static_cast<size_t>(num_steps_);
  std::vector<std::pair<size_t, size_t>> lives;  // (box, life), ordered by life
  for (size_t i = 0; i < bodies_.size(); ++i) lives.emplace_back(i, 0);
  for (size_t i = 0; i < bodies_.size(); ++i) {
    for (size_t life = 1; life < bodies_[i].size(); ++life) lives.emplace_back(i, life);
  }
  // Ids of boxes that are no tracks of the recorded scene: parked cars.
  int64_t next_id = 0;
  for (size_t i = 0; recorded && i < recorded->tracks.size(); ++i) {
    next_id = std::max(next_id, recorded->tracks[i].id + 1);
  }
  for (const auto& [i, life] : lives) {
    const AgentBox& body = bodies_[i][life];
    const auto is_valid = [this, i = i, life = life](size_t step) {
      const size_t at = step * bodies_.size() + i;
      return valid_[at] && life_[at] == static_cast<int32_t>(life);
    };
    const RecordedTrack* const of_scene = recorded && i < recorded->tracks.size() ? &recorded->tracks[i] : nullptr;
    RecordedTrack track{
        .id = of_scene ? of_scene->id : next_id + static_cast<int64_t>(i + life * bodies_.size()),
        .type = of_scene ? of_scene->type : type_of(body.agent_class),
        .control = static_cast<int>(i) < spec_.num_agents ? RecordedControl::unstated : RecordedControl::still,
        .length_m = body.length_m,
        .width_m = body.width_m,
        .height_m = body.height_m};
    for (size_t step = 0; step < steps; ++step) {
      if (!is_valid(step)) continue;
      if (track.num_valid++ == 0) track.first_valid = static_cast<int32_t>(step);
      track.last_valid = static_cast<int32_t>(step);
    }
    if (track.num_valid == 0) continue;
    if (static_cast<int>(i) == self_agent && scenario.sdc_track < 0)
      scenario.sdc_track = static_cast<int32_t>(scenario.tracks.size());
    scenario.tracks.push_back(track);
    for (size_t step = 0; step < steps; ++step) {
      const bool is_present = is_valid(step);
      scenario.states.push_back(is_present ? states_[step * bodies_.size() + i] : TrackState{});
      scenario.valid.push_back(is_present ? 1 : 0);
      scenario.driven.push_back(is_present ? driven_[step * bodies_.size() + i] : SavedMotion{});
    }
  }
  if (self_agent >= 0 && scenario.sdc_track < 0) {
    fail_usage("expected a recorded agent as the self-driving car, got {}", self_agent);
  }

  const auto num_lights = scenario.map.lights.size();
  move_lights(&scenario);
  for (size_t light = 0; light < num_lights; ++light) {
    for (size_t step = 0; step < steps; ++step) {
      scenario.light_states.push_back(lights_[step * num_lights + light]);
    }
  }
  if (recorded) copy_lights(*recorded, map.start_step + first_step_, &scenario);
  validate(scenario);
  return scenario;
}

}  // namespace pictura
