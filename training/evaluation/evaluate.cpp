#include "pictura/training/evaluation/evaluate.h"

#include <algorithm>
#include <chrono>
#include <limits>

#include "pictura/backends/make_simulator.h"
#include "pictura/backends/upload_maps.h"
#include "pictura/common/error.h"
#include "pictura/common/support/interrupt.h"
#include "pictura/map/load_map.h"
#include "pictura/training/config.h"
#include "pictura/training/session.h"

namespace pictura {

namespace {

struct DensityOf {
  const char* name;
  int agents;
};
DensityOf density_of(Density density) {
  switch (density) {
    case Density::light: return {"light", 60};
    case Density::medium: return {"medium", 120};
    default: return {"dense", 150};
  }
}

// Worlds that are simulated and drawn together: bounded by what their images take, or a few thousand agents.
int worlds_per_batch(const Rig& rig, int agents_per_world) {
  constexpr int64_t kMaxImageBytes = int64_t{256} << 20;
  constexpr int64_t kMaxAgents = 4096;
  int64_t bytes_per_agent = 1;
  for (const Camera& camera : rig.cameras) bytes_per_agent += 3 * int64_t{camera.width_px} * camera.height_px;
  return static_cast<int>(
      std::max<int64_t>(1, std::min(kMaxAgents, kMaxImageBytes / bytes_per_agent) / agents_per_world));
}

bool has_active_agents(Simulator& simulator) {
  const uint8_t* const status = simulator.state().status;
  return std::any_of(status, status + simulator.num_slots(),
                     [](uint8_t s) { return static_cast<AgentStatus>(s) == AgentStatus::active; });
}

// Sums over vehicle episodes.
struct Tally {
  int64_t episodes = 0, at_fault = 0, off_road = 0, red_light = 0, infractions = 0, goals = 0, waypoints = 0;
  double distance_m = 0, returns = 0;

  void add(const AgentStateView& state, int64_t slot) {
    if (static_cast<AgentStatus>(state.status[slot]) == AgentStatus::absent) return;
    if (static_cast<AgentClass>(state.agent_class[slot]) != AgentClass::vehicle) return;
    const uint8_t events = state.episode_events[slot];
    ++episodes;
    at_fault += (events & kEventAtFault) != 0;
    off_road += (events & kEventOffRoad) != 0;
    red_light += (events & kEventRedLight) != 0;
    infractions += (events & (kEventAtFault | kEventOffRoad | kEventRedLight)) != 0;
    goals += state.goals_reached[slot];
    waypoints += state.waypoints_reached[slot];
    distance_m += static_cast<double>(state.distance_m[slot]);
    returns += static_cast<double>(state.episode_return[slot]);
  }

  EvaluateRow row(const std::string& density, int scenarios, int steps) const {
    const auto vehicles = static_cast<double>(episodes);
    EvaluateRow result;
    result.density = density;
    result.scenarios = scenarios;
    result.steps = steps;
    result.vehicle_episodes = episodes;
    result.at_fault_collision_rate = static_cast<double>(at_fault) / vehicles;
    result.off_road_rate = static_cast<double>(off_road) / vehicles;
    result.red_light_rate = static_cast<double>(red_light) / vehicles;
    result.goals_per_vehicle = static_cast<double>(goals) / vehicles;
    result.waypoints_per_vehicle = static_cast<double>(waypoints) / vehicles;
    result.return_per_vehicle = returns / vehicles;
    result.km_driven = distance_m / 1000;
    result.km_per_infraction =
        infractions > 0 ? result.km_driven / static_cast<double>(infractions) : std::numeric_limits<double>::infinity();
    return result;
  }
};

}  // namespace

EvaluateReport evaluate(const EvaluateOptions& options) {
  if (options.scenarios < 1) fail_usage("evaluate: expected one scenario or more, got {}", options.scenarios);
  if (options.steps < 1) fail_usage("evaluate: expected one step or more, got {}", options.steps);
  if (options.maps.empty()) fail_usage("evaluate: expected one map or more");
  if (options.agents_per_world < 0 || options.agents_per_world > kMaxAgentsPerWorld) {
    fail_usage("evaluate: expected 1 to {} agents per world, got {}", kMaxAgentsPerWorld, options.agents_per_world);
  }
  Config devices;
  devices.run.device = options.device;
  devices.simulator.backend = options.simulator;
  check_devices(devices);
  PolicySession session(options.checkpoint, {.num_threads = options.num_threads,
                                             .device = options.device,
                                             .renderer = options.renderer,
                                             .samples = options.samples});
  SimulatorConfig simulator_config = session.evaluation_world(options.steps);
  simulator_config.seed = options.seed;
  std::vector<std::shared_ptr<const RoadMap>> roads;
  for (const std::string& name : options.maps) roads.push_back(load_map(name));
  const CompiledMaps maps = compile_maps(roads, map_options(simulator_config), options.num_threads);

  std::vector<DensityOf> densities;
  if (options.agents_per_world > 0)
    densities.push_back({"custom", options.agents_per_world});
  else
    for (const Density density : options.densities) densities.push_back(density_of(density));
  double work = 0, done = 0;  // in agents times steps
  for (const DensityOf& density : densities) work += double(density.agents) * options.scenarios * options.steps;

  const auto start = std::chrono::steady_clock::now();
  const std::unique_ptr<Renderer> renderer = session.make_renderer();
  std::unique_ptr<Simulator> simulator;  // made with the first batch
  EvaluateReport report;
  for (const DensityOf& density : densities) {
    Tally tally;
    const int per_batch = worlds_per_batch(session.rig(), density.agents);
    for (int first = 0; first < options.scenarios; first += per_batch) {
      std::vector<WorldSpec> worlds;
      for (int scenario = first; scenario < std::min(first + per_batch, options.scenarios); ++scenario) {
        worlds.push_back({scenario % static_cast<int>(maps.size()), density.agents,
                          kFirstEvaluationWorld + static_cast<uint32_t>(scenario)});
      }
      if (simulator) {
        simulator->set_worlds(maps, {}, worlds, options.seed);
      } else {
        simulator = make_simulator(options.simulator, simulator_config, maps, worlds);
        if (renderer) upload_maps(*simulator, renderer.get());
      }
      const std::unique_ptr<Controller> controller =
          session.make_controller(renderer.get(), options.argmax, options.seed);
      std::vector<Command> commands(static_cast<size_t>(simulator->num_slots()));
      // Halted agents stay as they are, so a batch is over when no agent is active.
      for (int step = 0; step < options.steps && has_active_agents(*simulator); ++step) {
        if (interrupted()) {
          report.interrupted = true;
          return report;
        }
        controller->act(simulator->controller_input(), {}, commands);
        simulator->step(commands);
        if (options.on_progress && step % 10 == 0) {
          const double fraction = (done + double(simulator->num_slots()) * (step + 1)) / work;
          const double elapsed_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
          options.on_progress(fraction, elapsed_s * (1 - fraction) / fraction);
        }
      }
      done += double(simulator->num_slots()) * options.steps;
      const AgentStateView state = simulator->state();
      for (int slot = 0; slot < simulator->num_slots(); ++slot) tally.add(state, slot);
    }
    report.rows.push_back(tally.row(density.name, options.scenarios, options.steps));
  }
  if (options.on_progress) options.on_progress(1, 0);
  return report;
}

}  // namespace pictura
