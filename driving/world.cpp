#include "pictura/driving/world.h"

#include <algorithm>
#include <filesystem>

#include <fmt/ranges.h>

#include "pictura/backends/make_controller.h"
#include "pictura/backends/make_simulator.h"
#include "pictura/backends/upload_maps.h"
#include "pictura/common/support/suggestion.h"
#include "pictura/driving/reported_map.h"
#include "pictura/map/scenario/load_scenario.h"
#include "pictura/policy/session.h"
#include "pictura/simulator/controllers/host_controllers.h"
#include "pictura/simulator/controllers/shared_control.h"
#include "pictura/simulator/recorded_scene.h"

namespace pictura {

bool is_host_controller(const std::string& policy) {
  const std::vector<std::string> names = host_controller_names();
  return std::find(names.begin(), names.end(), policy) != names.end();
}

void apply_world_options(const WorldOptions& options, SimulatorConfig* config_inout) {
  SimulatorConfig& config = *config_inout;
  config.seed = options.seed;
  config.num_threads = options.num_threads;
  config.walls = config.walls && options.walls;
  config.light_heads = options.light_heads.value_or(config.light_heads);
  config.light_cycles = options.light_cycles.value_or(config.light_cycles);
  config.parked_cars = options.parked_cars.value_or(config.parked_cars);
  config.others = options.others;
  float &pedestrians = config.pedestrian_fraction, &cyclists = config.cyclist_fraction;
  pedestrians = options.pedestrian_fraction.value_or(pedestrians);
  cyclists = options.cyclist_fraction.value_or(cyclists);
  if (pedestrians + cyclists <= 1) return;
  if (options.pedestrian_fraction && options.cyclist_fraction) {
    fail_usage("--pedestrians and --cyclists: expected at most 1 together, got {} + {}", pedestrians, cyclists);
  }
  (options.pedestrian_fraction ? cyclists : pedestrians) = 1 - (options.pedestrian_fraction ? pedestrians : cyclists);
}

namespace {

/// Returns which tracks the policy drives, as [tracks]: the controlled tracks that are present at the start.
std::vector<uint8_t> controlled_tracks(const WorldOptions& options, const CompiledMap& map) {
  try {
    return tracks_of(*map.scenario, options.controlled, map.start_step);
  } catch (const UsageError& error) {
    fail_usage("--control: {}", error.what());
  }
}

}  // namespace

DrivenWorld make_world(const WorldOptions& options, const std::string& policy) {
  if (options.simulator == "cuda") {
    fail_usage(
        "--simulator cuda: its states and scenes lie on the device, and reading them back for pictures and reports is "
        "not supported in this version: use cpu");
  }
  SimulatorConfig config;
  DrivenWorld world;
  const bool is_trained = !is_host_controller(policy);
  config.vector_observations = options.vector_observations;
  if (is_trained) {
    const std::vector<std::string> names = host_controller_names();
    if (const std::string near = suggestion(policy, names); !near.empty() && !std::filesystem::exists(policy)) {
      fail_usage("--policy: expected {}, or a checkpoint's file, got '{}'{}", fmt::join(names, ", "), policy, near);
    }
    SessionOptions session = options;
    session.simulator = "cpu";
    world.session = std::make_shared<PolicySession>(policy, session);
    world.renderer = world.session->make_renderer();
    if (world.renderer) world.trained_view = world.session->renderer_config();
    const SimulatorConfig defaults;
    config = world.session->evaluation_world(defaults.episode_steps);
    config.reset_inactive_fraction = defaults.reset_inactive_fraction;
  }
  if (!is_trained && options.decision_steps > 0)
    fail_usage("--decision-steps: expected a trained policy, got --policy {}", policy);
  if (!is_trained && (options.others.blind > 0 || options.others.inattentive > 0)) {
    fail_usage("--blind and --inattentive: expected a trained policy, got --policy {}, which does not use observations",
               policy);
  }
  apply_world_options(options, &config);
  config.fixed_lights = true;
  std::vector<uint8_t> controlled;  // tracks of a recorded scene that do not follow the recording
  if (is_scene_name(options.map)) {
    const auto scene = std::make_shared<const Scenario>(load_scenario(options.map));
    config = scene_config(*scene, options.start_step, config);
    config.episode_steps = std::max(config.episode_steps, options.min_episode_steps);
    MapOptions compiled = map_options(config);
    compiled.recorded_lights = options.recorded_lights;
    const auto map = compile_scenario(scene, compiled, options.start_step);
    if (policy != "log") controlled = controlled_tracks(options, *map);
    world.simulator = make_simulator(options.simulator, config, CompiledMaps{map}, {scene_world(*map)});
    world.first_agent = std::max(scene->sdc_track, 0);
  } else {
    world.simulator =
        make_simulator(options.simulator, config, {load_reported_map(options.map)}, {{0, options.agents, 0}});
  }
  world.commands.resize(static_cast<size_t>(world.simulator->num_slots()));
  if (is_trained) {
    if (world.renderer) upload_maps(*world.simulator, world.renderer.get());
    world.controller = world.session->make_controller(world.renderer.get(), /*argmax=*/true, options.seed);
  }
  if (!world.controller) world.controller = make_controller(policy, *world.simulator, options.seed);
  if (controlled.empty()) return world;
  std::vector<Driver> drivers;
  drivers.push_back({.controller = make_controller("log", *world.simulator, options.seed)});
  drivers.push_back(driver_of(std::move(world.controller), std::move(controlled)));
  world.controller = std::make_unique<SharedControl>(std::move(drivers));
  return world;
}

}  // namespace pictura
