#include "pictura/evaluation/evaluate_scenes.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <optional>

#include <fmt/ranges.h>

#include "pictura/backends/make_controller.h"
#include "pictura/backends/make_simulator.h"
#include "pictura/backends/upload_maps.h"
#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/common/support/hash.h"
#include "pictura/common/support/parallel_for.h"
#include "pictura/evaluation/evaluate.h"
#include "pictura/evaluation/progress.h"
#include "pictura/evaluation/scene_plan.h"
#include "pictura/map/file_position.h"
#include "pictura/map/scenario/load_scenario.h"
#include "pictura/policy/learning_device.h"
#include "pictura/policy/session.h"
#include "pictura/simulator/drive_steps.h"
#include "pictura/simulator/recorded_scene.h"
#include "pictura/simulator/rules/limits.h"

namespace pictura {

namespace {

// Number of worlds simulated together. On a GPU the number is large enough to saturate the GPU.
int scenes_at_once(const SceneEvaluateOptions& options, Device device) {
  if (options.scenes_at_once > 0) return options.scenes_at_once;
  return device.is_host() ? 16 : 256;
}

std::string name_of(const SceneRef& scene) {
  return scene.record < 0 ? scene.file : fmt::format("{}#{}", scene.file, scene.record);
}

/// Scenes that are simulated together.
struct LoadedScenes {
  CompiledMaps maps;
  std::vector<int> numbers;  // [maps] number of each map's scene among all scenes
  // Scenes that are left out:
  std::vector<std::string> faults;
  int without_drivers = 0;
};

/// Loads and compiles the scenes [first, end).
LoadedScenes load_batch(const std::vector<SceneRef>& scenes, int first, int end, const SceneProtocol& protocol,
                        const MapOptions& map_options, int num_threads) {
  const auto count = static_cast<size_t>(end - first);
  std::vector<std::shared_ptr<const CompiledMap>> maps(count);
  std::vector<std::string> faults(count);
  parallel_for(num_threads, end - first, [&](int64_t item) {
    const auto i = static_cast<size_t>(item);
    const SceneRef& scene = scenes[static_cast<size_t>(first) + i];
    try {
      maps[i] = compile_scenario(protocol_scene(load_scenario(scene), protocol), map_options, protocol.start_step);
    } catch (const Error& error) {
      const std::string what = error.what();
      faults[i] = what.starts_with(scene.file) ? what : fmt::format("{}: {}", name_of(scene), what);
    }
  });
  LoadedScenes batch;
  for (size_t i = 0; i < count; ++i) {
    if (!maps[i]) {
      batch.faults.push_back(faults[i]);
    } else if (!has_drivers(*maps[i], protocol)) {
      ++batch.without_drivers;
    } else {
      batch.maps.push_back(maps[i]);
      batch.numbers.push_back(first + static_cast<int>(i));
    }
  }
  return batch;
}

template <typename T>
Array array_of(const DeviceCopy<T>& copy, const Dims& shape, Device device) {
  return Array(copy.span().data(), shape, device);
}

/// Converts a box to a state in the coordinates of the scene's file. The state's centre is rise_m above the box's
/// centre.
SimulatedState simulated_state(const RoadMap& map, const AgentBox& box, float rise_m) {
  const std::array<double, 3> center_m = file_position_m(map.origin_m, box.center_m + Vec3{0, 0, rise_m});
  return {static_cast<float>(center_m[0]), static_cast<float>(center_m[1]), static_cast<float>(center_m[2]),
          std::atan2(box.sin_heading, box.cos_heading)};
}

/// One rollout of a batch of scenes at one density, from start to end.
class BatchDrive {
 public:
  BatchDrive(const LoadedScenes& batch, const SceneProtocol& protocol, double density, int rollout, uint64_t seed,
             Simulator* simulator)
      : batch_(batch), protocol_(protocol), density_(density), rollout_(rollout), simulator_(*simulator) {
    const std::vector<AgentBox> boxes = host_copy(simulator_.scene().agents, device());
    const auto num_slots = static_cast<size_t>(simulator_.num_slots());
    roles_.reserve(num_slots);
    for (size_t world = 0; world < batch.maps.size(); ++world) {
      const CompiledMap& map = *batch.maps[world];
      const size_t first = roles_.size(), count = map.scenario->tracks.size();
      const ScenePlan plan =
          plan_scene(map, Span<const AgentBox>(boxes).subspan(first, count), protocol, density, seed);
      roles_.insert(roles_.end(), plan.roles.begin(), plan.roles.end());
      takeover_steps_.insert(takeover_steps_.end(), plan.takeover_steps.begin(), plan.takeover_steps.end());
      for (size_t track = 0; track < count; ++track) {
        world_of_slot_.push_back(static_cast<int32_t>(world));
        track_of_slot_.push_back(static_cast<int32_t>(track));
      }
    }
    last_steps_.resize(num_slots);
    displacements_.resize(num_slots);
    driven_steps_.resize(num_slots);
    for (size_t slot = 0; slot < num_slots; ++slot) last_steps_[slot] = map_of(slot).rules.record.num_steps - 1;
    remove_agents(slots_where([&](size_t slot) { return roles_[slot] == SceneRole::removed; }));
    if (protocol.waypoints == Waypoints::path) set_path_waypoints();
    status_ = status();
  }

  /// Starts to record the poses of all agents that are present at the start.
  void start_recording_poses() {
    kept_slots_ = slots_where([&](size_t slot) {
      const CompiledMap& map = map_of(slot);
      return map.scenario->valid_of(track_of_slot_[slot])[map.start_step] != 0;
    });
    poses_.resize(kept_slots_.size() * static_cast<size_t>(protocol_.steps));
    // Simulated boxes stand exactly on the road, whereas recorded boxes are slightly above or below it. A constant
    // offset per agent prevents a jump in height at the start.
    const std::vector<AgentBox> boxes = host_copy(simulator_.scene().agents, device());
    for (const int32_t kept : kept_slots_) {
      const auto slot = static_cast<size_t>(kept);
      const CompiledMap& map = map_of(slot);
      const float foot_m = map.scenario->states_of(track_of_slot_[slot])[map.start_step].position_m.z;
      rises_m_.push_back(foot_m + boxes[slot].height_m / 2 - boxes[slot].center_m.z);
    }
    record_poses(0);
  }

  /// Adds the recorded poses to each scene of the batch.
  void add_rollout(std::vector<SceneRollouts>* scenes_inout) const {
    scenes_inout->resize(batch_.maps.size());
    for (size_t world = 0; world < batch_.maps.size(); ++world) {
      SceneRollouts& scene = (*scenes_inout)[world];
      scene.scenario_id = batch_.maps[world]->scenario->id;
      scene.steps = protocol_.steps;
      scene.rollouts.emplace_back();
    }
    const auto steps = static_cast<size_t>(protocol_.steps);
    for (size_t i = 0; i < kept_slots_.size(); ++i) {
      const auto slot = static_cast<size_t>(kept_slots_[i]);
      SceneRollouts& scene = (*scenes_inout)[world_of_slot_[slot]];
      if (scene.rollouts.size() == 1) {
        scene.track_ids.push_back(map_of(slot).scenario->tracks[track_of_slot_[slot]].id);
      }
      const auto first = poses_.begin() + static_cast<ptrdiff_t>(i * steps);
      std::vector<SimulatedState>& poses = scene.rollouts.back();
      poses.insert(poses.end(), first, first + static_cast<ptrdiff_t>(steps));
    }
  }

  /// Drives all steps. If no poses are recorded, stops as soon as no agent drives any more. Returns false after an
  /// interrupt. Calls on_step(completed steps).
  template <typename OnStep>
  bool run(Controller* driver, const OnStep& on_step) {
    const std::unique_ptr<Controller> log = pictura::make_controller("log", simulator_, 0);
    DeviceCopy<Command> command_memory(std::vector<Command>(static_cast<size_t>(simulator_.num_slots())), device());
    const Span<Command> commands = command_memory.span();
    std::vector<uint8_t> driven, replayed;
    std::optional<DeviceCopy<uint8_t>> driven_mask, replayed_mask;
    const auto act = [&](int step) {
      if (kept_slots_.empty() && !has_remaining_drivers(step)) return false;
      if (protocol_.record_end == RecordEnd::vanish) {
        remove_agents(slots_where([&](size_t slot) {
          return last_steps_[slot] == step && !is_driven(slot, step) && status_[slot] == AgentStatus::recorded;
        }));
      }
      // The drivers change when an agent appears or vanishes.
      std::vector<uint8_t> drives = mask_where([&](size_t slot) { return is_driven(slot, step); });
      std::vector<uint8_t> follows = mask_where([&](size_t slot) { return is_replayed(slot, step); });
      if (!driven_mask || drives != driven || follows != replayed) {
        driven = std::move(drives);
        replayed = std::move(follows);
        driven_mask.emplace(driven, device());
        replayed_mask.emplace(replayed, device());
      }
      driver->act(simulator_.arrays(), driven_mask->span(), commands);
      log->act(simulator_.arrays(), replayed_mask->span(), commands);
      return true;
    };
    const auto after_step = [&](int step, const StepResult&) {
      measure(step + 1);
      if (!kept_slots_.empty()) record_poses(step);
      on_step(step + 1);
    };
    return !drive_steps(simulator_, commands, protocol_.steps, act, {}, after_step).is_interrupted;
  }

  /// Returns the results of the driven road users, [scenes of the batch][driven], in the order of tracks.
  std::vector<std::vector<SceneAgent>> results() const {
    const AgentStateView state = simulator_.state();
    const auto num_slots = static_cast<size_t>(simulator_.num_slots());
    const std::vector<uint8_t> events = host_copy(Span<const uint8_t>(state.episode_events, num_slots), device());
    const std::vector<int32_t> goals = host_copy(Span<const int32_t>(state.goals_reached, num_slots), device());
    const std::vector<float> distance_m = host_copy(Span<const float>(state.distance_m, num_slots), device());
    std::vector<std::vector<SceneAgent>> scenes(batch_.maps.size());
    for (size_t slot = 0; slot < num_slots; ++slot) {
      // An agent whose episode ended before its takeover has not driven.
      if (roles_[slot] != SceneRole::driven || driven_steps_[slot] == 0) continue;
      const Scenario& scene = *map_of(slot).scenario;
      const RecordedTrack& track = scene.tracks[track_of_slot_[slot]];
      const Displacement& displacement = displacements_[slot];
      SceneAgent agent{.scenario_id = scene.id,
                       .density = density_,
                       .rollout = rollout_,
                       .track_id = track.id,
                       .type = track.type,
                       .takeover_step = takeover_steps_[slot],
                       .driven_steps = driven_steps_[slot],
                       .events = events[slot],
                       .arrived = goals[slot] > 0,
                       .distance_m = distance_m[slot]};
      if (displacement.steps > 0) {
        agent.mean_displacement_m = static_cast<float>(displacement.sum_m / displacement.steps);
        agent.final_displacement_m = displacement.last_m;
      }
      scenes[world_of_slot_[slot]].push_back(std::move(agent));
    }
    return scenes;
  }

 private:
  struct Displacement {
    int steps = 0;
    double sum_m = 0;
    float last_m = 0;
  };

  Device device() const { return simulator_.device(); }
  const CompiledMap& map_of(size_t slot) const { return *batch_.maps[world_of_slot_[slot]]; }
  bool is_driven(size_t slot, int step) const {
    return roles_[slot] == SceneRole::driven && takeover_steps_[slot] <= step;
  }
  bool is_replayed(size_t slot, int step) const {
    if (roles_[slot] == SceneRole::removed || is_driven(slot, step)) return false;
    return protocol_.record_end == RecordEnd::stand || step < last_steps_[slot];
  }
  /// Whether an agent drives in this step, or will drive later.
  bool has_remaining_drivers(int step) const {
    for (size_t slot = 0; slot < roles_.size(); ++slot) {
      if (roles_[slot] != SceneRole::driven) continue;
      if (takeover_steps_[slot] > step || takes_actions(status_[slot])) return true;
    }
    return false;
  }

  template <typename Predicate>
  std::vector<uint8_t> mask_where(const Predicate& is_chosen) const {
    std::vector<uint8_t> mask(roles_.size());
    for (size_t slot = 0; slot < mask.size(); ++slot) mask[slot] = is_chosen(slot);
    return mask;
  }
  template <typename Predicate>
  std::vector<int32_t> slots_where(const Predicate& is_chosen) const {
    std::vector<int32_t> slots;
    for (size_t slot = 0; slot < roles_.size(); ++slot) {
      if (is_chosen(slot)) slots.push_back(static_cast<int32_t>(slot));
    }
    return slots;
  }

  std::vector<AgentStatus> status() const {
    return host_copy(Span<const AgentStatus>(simulator_.state().status, roles_.size()), device());
  }

  /// Removes agents. They remain absent unless a command makes them follow the recording.
  void remove_agents(const std::vector<int32_t>& slots) {
    if (slots.empty()) return;
    const DeviceCopy<int32_t> chosen(slots, device());
    const DeviceCopy<AgentStatus> absent(std::vector<AgentStatus>(slots.size(), AgentStatus::absent), device());
    const Dims shape{static_cast<int64_t>(slots.size())};
    const NamedArray field{"status", array_of(absent, shape, device())};
    simulator_.set_state(array_of(chosen, shape, device()), Span(&field, 1));
  }

  void set_path_waypoints() {
    const std::vector<int32_t> slots = slots_where([&](size_t slot) { return roles_[slot] == SceneRole::driven; });
    if (slots.empty()) return;
    std::vector<float> x_m, y_m, z_m;
    for (const int32_t slot : slots) {
      const auto at = static_cast<size_t>(slot);
      for (const Vec3& waypoint : path_waypoints(map_of(at), track_of_slot_[at], takeover_steps_[at])) {
        x_m.push_back(waypoint.x);
        y_m.push_back(waypoint.y);
        z_m.push_back(waypoint.z);
      }
    }
    const DeviceCopy<int32_t> chosen(slots, device()), next(std::vector<int32_t>(slots.size(), 0), device());
    const DeviceCopy<float> x(x_m, device()), y(y_m, device()), z(z_m, device());
    const auto count = static_cast<int64_t>(slots.size());
    const Dims shape{count}, waypoints{count, kNumWaypoints};
    const std::vector<NamedArray> fields{{"waypoint_x_m", array_of(x, waypoints, device())},
                                         {"waypoint_y_m", array_of(y, waypoints, device())},
                                         {"waypoint_z_m", array_of(z, waypoints, device())},
                                         {"next_waypoint", array_of(next, shape, device())}};
    simulator_.set_state(array_of(chosen, shape, device()), fields);
  }

  /// Updates driven steps and displacements after the simulator has reached episode step `step`.
  void measure(int step) {
    const std::vector<AgentStatus> before = std::exchange(status_, status());
    std::vector<AgentBox> boxes;
    for (size_t slot = 0; slot < roles_.size(); ++slot) {
      if (!is_driven(slot, step - 1)) continue;
      if (!takes_actions(before[slot])) continue;
      ++driven_steps_[slot];
      if (step > last_steps_[slot]) continue;
      // Boxes are copied only if an agent is measured.
      if (boxes.empty()) boxes = host_copy(simulator_.scene().agents, device());
      const CompiledMap& map = map_of(slot);
      const std::optional<float> apart_m =
          displacement_m(*map.scenario, track_of_slot_[slot], map.start_step + step, boxes[slot].center_m);
      if (!apart_m) continue;
      Displacement& sum = displacements_[slot];
      ++sum.steps;
      sum.sum_m += static_cast<double>(*apart_m);
      sum.last_m = *apart_m;
    }
  }

  /// Records the current poses as those after step `step`. Absent agents keep their last pose. A call with step 0
  /// before the first step gives every agent an initial last pose.
  void record_poses(int step) {
    const std::vector<AgentBox> boxes = host_copy(simulator_.scene().agents, device());
    const auto steps = static_cast<size_t>(protocol_.steps), at = static_cast<size_t>(step);
    for (size_t i = 0; i < kept_slots_.size(); ++i) {
      const auto slot = static_cast<size_t>(kept_slots_[i]);
      SimulatedState* const poses = &poses_[i * steps];
      if (boxes[slot].drawn)
        poses[at] = simulated_state(map_of(slot).scenario->map, boxes[slot], rises_m_[i]);
      else if (at > 0)
        poses[at] = poses[at - 1];
    }
  }

  const LoadedScenes& batch_;
  const SceneProtocol& protocol_;
  double density_;
  int rollout_;
  Simulator& simulator_;
  std::vector<SceneRole> roles_;         // [slots], as are the next members
  std::vector<int32_t> takeover_steps_;  // episode step
  std::vector<int32_t> world_of_slot_, track_of_slot_;
  std::vector<int32_t> last_steps_;  // last recorded episode step
  std::vector<AgentStatus> status_;  // after the last step
  std::vector<Displacement> displacements_;
  std::vector<int32_t> driven_steps_;
  std::vector<int32_t> kept_slots_;  // slots whose poses are recorded
  std::vector<float> rises_m_;  // [kept_slots] height of the recorded box's centre above the simulated box's centre
  std::vector<SimulatedState> poses_;  // [kept_slots * steps]
};

/// Returns the worlds of one rollout of a batch; scene numbers count from first_scene on. Each rollout of each scene
/// has its own world number, because random draws depend on the world number.
std::vector<WorldSpec> worlds_of(const LoadedScenes& batch, int first_scene, int rollout, int num_rollouts) {
  std::vector<WorldSpec> worlds;
  for (size_t i = 0; i < batch.maps.size(); ++i) {
    const auto scene = static_cast<uint32_t>(first_scene + batch.numbers[i]);
    const uint32_t number = scene * static_cast<uint32_t>(num_rollouts) + static_cast<uint32_t>(rollout);
    worlds.push_back(scene_world(*batch.maps[i], static_cast<int>(i), kFirstEvaluationWorld + number));
  }
  return worlds;
}

/// Hash of the names and bytes of the scenes' files, independent of their location.
std::string hash_of(const std::vector<SceneRef>& scenes, int num_threads) {
  std::vector<std::string> files;
  for (const SceneRef& scene : scenes) {
    if (files.empty() || files.back() != scene.file) files.push_back(scene.file);
  }
  std::vector<std::string> hashes(files.size());
  parallel_for(num_threads, static_cast<int64_t>(files.size()), [&](int64_t item) {
    const auto i = static_cast<size_t>(item);
    hashes[i] = std::filesystem::path(files[i]).filename().string() + ' ' + hash_of_file(files[i]) + '\n';
  });
  Hash64 hash;
  for (const std::string& line : hashes) hash.add_bytes(line.data(), line.size());
  return hash.hex();
}

/// Finds the scenes of the options, and the files without readable scenes. Writes the hash of all scenes to `hash_out`
/// if requested.
SceneIndex find_all(const SceneEvaluateOptions& options, std::string* hash_out) {
  if (options.scenes.empty()) fail_usage("evaluate: expected scenes, got none");
  SceneIndex all;
  for (const std::string& name : options.scenes) {
    SceneIndex some = find_scenes(name);
    std::move(some.scenes.begin(), some.scenes.end(), std::back_inserter(all.scenes));
    std::move(some.faults.begin(), some.faults.end(), std::back_inserter(all.faults));
  }
  const auto found = static_cast<int>(all.scenes.size());
  if (found > 0 && (options.first_scene < 0 || options.first_scene >= found)) {
    fail_usage("evaluate: expected a first scene in [0, {}), got {}", found, options.first_scene);
  }
  if (options.hashes_scenes) *hash_out = hash_of(all.scenes, options.num_threads);
  const int end = options.num_scenes > 0 ? std::min(found, options.first_scene + options.num_scenes) : found;
  all.scenes = {all.scenes.begin() + std::min(found, options.first_scene), all.scenes.begin() + end};
  return all;
}

/// Adds the agents of one scene of a batch to the counts of each density. agents: [drives][scenes][driven]; a drive is
/// one rollout at one density.
void count_agents(const std::vector<std::vector<std::vector<SceneAgent>>>& agents, size_t scene,
                  const SceneEvaluateOptions& options, SceneResults* results) {
  const auto num_rollouts = static_cast<size_t>(options.protocol.rollouts);
  for (size_t density = 0; density < options.protocol.densities.size(); ++density) {
    SceneCounts& counts = results->counts[density].emplace_back();
    for (size_t drive = density * num_rollouts; drive < (density + 1) * num_rollouts; ++drive) {
      for (const SceneAgent& agent : agents[drive][scene]) {
        const bool is_vehicle = agent.type != TrackType::pedestrian && agent.type != TrackType::cyclist;
        add(agent, is_vehicle, &counts);
        if (options.on_agent) options.on_agent(agent);
      }
    }
  }
}

/// Scores the rollouts of a batch's scenes.
void add_realism(const LoadedScenes& batch, const std::vector<SceneRollouts>& rollouts,
                 const SceneEvaluateOptions& options, RealismReport* report_inout) {
  std::vector<SceneRealism> scores(batch.maps.size());
  std::vector<std::string> faults(batch.maps.size());
  parallel_for(options.num_threads, static_cast<int64_t>(scores.size()), [&](int64_t item) {
    const auto i = static_cast<size_t>(item);
    try {
      scores[i] = RealismScene(batch.maps[i]->scenario).score(rollouts[i], realism_version(options.realism));
    } catch (const Error& error) {
      faults[i] = error.what();
    }
  });
  for (size_t i = 0; i < scores.size(); ++i) {
    if (faults[i].empty())
      report_inout->scenes.push_back(std::move(scores[i]));
    else
      report_inout->faults.push_back(std::move(faults[i]));
  }
}

SceneEvaluation evaluate_scenes(const EvaluatedDriver& driver, Renderer* renderer,
                                const SceneEvaluateOptions& options) {
  const SceneProtocol& protocol = options.protocol;
  SceneEvaluation evaluation;
  SceneResults& results = evaluation.results;
  results.setting = driver.setting;
  SceneIndex index = find_all(options, &results.setting.maps_hash);
  results.setting.maps = options.scenes;
  results.setting.steps = protocol.steps;
  results.setting.argmax = options.argmax;
  results.setting.seed = options.seed;
  results.protocol = protocol;
  results.unread = std::move(index.faults);
  results.first_scene = options.first_scene;
  results.counts.resize(protocol.densities.size());
  evaluation.found = static_cast<int>(index.scenes.size());

  SimulatorConfig config = protocol_config(protocol, driver.world);
  config.seed = options.seed;
  MapOptions map_options = pictura::map_options(config);
  map_options.observed_span_m = protocol.observed_span_m;
  std::unique_ptr<Simulator> simulator;
  EvaluationClock clock(options.on_progress);
  const bool keeps_rollouts = options.on_rollouts || !options.realism.empty();
  evaluation.realism.version = options.realism;
  const int at_once = scenes_at_once(options, driver.device);
  const auto num_drives = static_cast<int>(protocol.densities.size()) * protocol.rollouts;
  const double work = double(evaluation.found) * num_drives * protocol.steps;
  for (int first = 0; first < evaluation.found && !evaluation.interrupted; first += at_once) {
    const int end = std::min(first + at_once, evaluation.found);
    const LoadedScenes batch = load_batch(index.scenes, first, end, protocol, map_options, options.num_threads);
    if (renderer && !batch.maps.empty()) upload_maps(batch.maps, {}, renderer);
    std::vector<std::vector<std::vector<SceneAgent>>> agents;  // [drives][scenes][driven]
    std::vector<SceneRollouts> rollouts;                       // [scenes], if requested
    for (int i = 0; i < num_drives && !batch.maps.empty() && !evaluation.interrupted; ++i) {
      const int rollout = i % protocol.rollouts;
      const std::vector<WorldSpec> worlds = worlds_of(batch, options.first_scene, rollout, protocol.rollouts);
      if (simulator)
        simulator->set_worlds(batch.maps, {}, worlds, options.seed);
      else
        simulator = make_simulator(options.simulator, config, batch.maps, worlds);
      const double density = protocol.densities[i / protocol.rollouts];
      BatchDrive drive(batch, protocol, density, rollout, options.seed, simulator.get());
      if (keeps_rollouts) drive.start_recording_poses();
      const Driving driving = driver.drive(*simulator);
      const double done = double(first) * num_drives * protocol.steps + double(end - first) * i * protocol.steps;
      const bool is_finished = drive.run(driving.controller.get(), [&](int steps) {
        if (steps == 1 || steps % 10 == 0) clock.update((done + double(end - first) * steps) / work);
      });
      if (!is_finished) {
        evaluation.interrupted = true;
        break;
      }
      agents.push_back(drive.results());
      if (keeps_rollouts) drive.add_rollout(&rollouts);
    }
    if (evaluation.interrupted) break;
    for (size_t scene = 0; scene < batch.maps.size(); ++scene) {
      count_agents(agents, scene, options, &results);
      results.repaired_headings += batch.maps[scene]->scenario->repaired_headings;
      if (options.on_rollouts) options.on_rollouts(rollouts[scene]);
    }
    if (!options.realism.empty()) add_realism(batch, rollouts, options, &evaluation.realism);
    results.faults.insert(results.faults.end(), batch.faults.begin(), batch.faults.end());
    results.without_drivers += batch.without_drivers;
    results.num_scenes = end;
  }
  evaluation.seconds = clock.seconds();
  const std::vector<std::string> faults = evaluation.faults();
  PICTURA_CHECK(results.scored() > 0 || evaluation.interrupted || results.without_drivers > 0,
                "{}: expected a usable scene, got {} unusable: {}", fmt::join(options.scenes, ", "), faults.size(),
                faults.empty() ? "no scene found" : faults.front());
  evaluation.rows = rows_of(results);
  if (!evaluation.interrupted) clock.finish();
  return evaluation;
}

}  // namespace

std::vector<std::string> SceneEvaluation::faults() const {
  std::vector<std::string> all = results.unread;
  all.insert(all.end(), results.faults.begin(), results.faults.end());
  return all;
}

SimulatorConfig protocol_config(const SceneProtocol& protocol, SimulatorConfig config) {
  config = scene_config(Scenario{}, 0, config);
  config.dt_s = kMaxStep_s;
  config.episode_steps = protocol.steps;
  config.after_infraction = protocol.after_infraction;
  config.leave_at_goal = protocol.leave_at_goal;
  return config;
}

SceneEvaluation evaluate_scenes(const SceneEvaluateOptions& options) {
  check(options.protocol);
  if (options.on_rollouts || !options.realism.empty()) check_rollouts(options.protocol);
  if (!options.realism.empty()) realism_version(options.realism);
  if (!options.controller.empty()) {
    return evaluate_scenes(controller_driver(options, options.protocol.steps), nullptr, options);
  }
  PolicySession session(options.checkpoint, options);
  const std::unique_ptr<Renderer> renderer = session.make_renderer();
  return evaluate_scenes(policy_driver(&session, renderer.get(), options, options.protocol.steps), renderer.get(),
                         options);
}

}  // namespace pictura
