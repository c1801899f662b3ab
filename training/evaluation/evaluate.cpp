#include "pictura/training/evaluation/evaluate.h"

#include <algorithm>

#include "pictura/backends/make_controller.h"
#include "pictura/backends/make_simulator.h"
#include "pictura/backends/upload_maps.h"
#include "pictura/common/error.h"
#include "pictura/common/support/interrupt.h"
#include "pictura/common/support/suggestion.h"
#include "pictura/map/load_map.h"
#include "pictura/simulator/agent_state.h"
#include "pictura/training/config.h"
#include "pictura/training/phase_timer.h"
#include "pictura/training/saved_policy.h"
#include "pictura/training/session.h"
#include "pictura/training/torch_device.h"

namespace pictura {

namespace {

struct DensityOf {
  const char* name;
  int agents;
};
DensityOf density_of(Density density) {
  const auto index = static_cast<size_t>(density);
  return {kDensityNames[index], kDensityAgents[index]};
}

// Worlds that are simulated together: on a device all 200 of the paper's densities, which keep it busy. Images take no
// part in it: they are drawn for train.forward_chunk agents at a time.
int worlds_per_batch(Device device, int agents_per_world) {
  const int max_agents = device.is_host() ? 4096 : 32768;
  return std::max(1, max_agents / agents_per_world);
}

// The agents' fields that are counted, on the host; all others are empty.
AgentState counted_state(Simulator& simulator) {
  const AgentStateView state = simulator.state();
  AgentState host(0);
  const auto copy = [&simulator](const auto* field, auto* out) {
    *out = host_copy(Span(field, static_cast<size_t>(simulator.num_slots())), simulator.device());
  };
  copy(state.status, &host.status);
  copy(state.agent_class, &host.agent_class);
  copy(state.episode_events, &host.episode_events);
  copy(state.goals_reached, &host.goals_reached);
  copy(state.waypoints_reached, &host.waypoints_reached);
  copy(state.distance_m, &host.distance_m);
  copy(state.episode_return, &host.episode_return);
  return host;
}

void add(const AgentStateView& state, int64_t slot, ScenarioCounts* counts) {
  const auto status = static_cast<AgentStatus>(state.status[slot]);
  if (status == AgentStatus::absent) return;
  if (static_cast<AgentClass>(state.agent_class[slot]) != AgentClass::vehicle) return;
  const uint8_t events = state.episode_events[slot];
  ++counts->vehicles;
  counts->at_fault += (events & kEventAtFault) != 0;
  counts->off_road += (events & kEventOffRoad) != 0;
  counts->red_light += (events & kEventRedLight) != 0;
  counts->infractions += (events & (kEventAtFault | kEventOffRoad | kEventRedLight)) != 0;
  counts->active_at_end += status == AgentStatus::active;
  counts->goals += state.goals_reached[slot];
  counts->waypoints += state.waypoints_reached[slot];
  counts->distance_m += static_cast<double>(state.distance_m[slot]);
  counts->returns += static_cast<double>(state.episode_return[slot]);
}

void check(const EvaluateOptions& options) {
  if (options.first_scenario < 0) fail_usage("evaluate: expected a scenario from 0, got {}", options.first_scenario);
  if (options.scenarios < 1) fail_usage("evaluate: expected one scenario or more, got {}", options.scenarios);
  if (options.steps < 1) fail_usage("evaluate: expected one step or more, got {}", options.steps);
  if (options.maps.empty()) fail_usage("evaluate: expected one map or more");
  if (options.agents_per_world < 0 || options.agents_per_world > kMaxAgentsPerWorld) {
    fail_usage("evaluate: expected 1 to {} agents per world, got {}", kMaxAgentsPerWorld, options.agents_per_world);
  }
}

// What drives the agents of a batch of worlds, and how many it drove when it last acted.
struct Driving {
  std::unique_ptr<Controller> controller;
  std::function<int64_t()> num_driven;
};

// Who is evaluated, and where.
struct Driver {
  SimulatorConfig world;
  EvaluationSetting setting;  // what of it is the driver's
  Device device;
  std::function<Driving(Simulator&)> drive;
};

Driver driver_of(PolicySession* session, Renderer* renderer, const EvaluateOptions& options) {
  return {session->evaluation_world(options.steps), session->evaluation_setting(), session->device(),
          [session, renderer, &options](Simulator&) {
            std::unique_ptr<PolicyController> controller =
                session->make_controller(renderer, options.argmax, options.seed);
            const PolicyController* const policy = controller.get();
            return Driving{std::move(controller), [policy] { return policy->num_driven(); }};
          }};
}

int64_t count_active(Simulator& simulator) {
  const Span<const uint8_t> status(simulator.state().status, static_cast<size_t>(simulator.num_slots()));
  const std::vector<uint8_t> all = host_copy(status, simulator.device());
  return std::count(all.begin(), all.end(), static_cast<uint8_t>(AgentStatus::active));
}

// One that needs no policy.
Driver driver_of(const std::string& controller, const EvaluateOptions& options) {
  Config config = options.checkpoint.empty() ? Config() : read_policy(options.checkpoint).config;
  config = with_evaluate_conditioning(config, options.conditioning);
  config.policy.modality = Modality::perspective;  // nobody reads vectors,
  config.render.backend = "auto";                  // and nothing is drawn
  config.run.num_threads = options.num_threads;
  config.run.device = options.device;
  config.simulator.backend = options.simulator;
  const bool drives_on_host = controller == "lane";
  if (drives_on_host && options.device == "auto" && options.simulator == "auto") config.run.device = "cpu";
  Driver driver;
  driver.device = open_learning_device(config);
  driver.world = evaluation_simulator_config(config, options.steps, driver.device);
  driver.setting.policy_hash = controller;
  driver.setting.conditioning = config.evaluate.conditioning;
  driver.setting.device = driver.device.is_host() ? "cpu" : drives_on_host ? "cuda, driven from the host" : "cuda";
  driver.drive = [controller, &options](Simulator& simulator) {
    return Driving{make_controller(controller, simulator, options.seed),
                   [&simulator] { return count_active(simulator); }};
  };
  return driver;
}

EvaluateReport evaluate(const Driver& driver, const EvaluateOptions& options, EvaluationWorlds* shared) {
  const CompiledMaps& maps = shared->maps;
  SimulatorConfig simulator_config = driver.world;
  simulator_config.seed = options.seed;
  std::vector<DensityOf> densities;
  if (options.agents_per_world > 0)
    densities.push_back({"custom", options.agents_per_world});
  else
    for (const Density density : options.densities) densities.push_back(density_of(density));
  double work = 0, done = 0;  // in agents times steps
  for (const DensityOf& density : densities) work += double(density.agents) * options.scenarios * options.steps;

  const Stopwatch since_start;
  double first_s = -1, first_fraction = 0;  // when the first step was done, and what part it was
  EvaluateReport report;
  report.results.setting = driver.setting;
  EvaluationSetting& setting = report.results.setting;
  setting.maps = options.maps;
  setting.steps = options.steps;
  setting.argmax = options.argmax;
  setting.seed = options.seed;
  for (const DensityOf& density : densities) {
    DensityResult result{density.name, density.agents, options.first_scenario, {}};
    result.scenarios.resize(static_cast<size_t>(options.scenarios));
    const int per_batch = worlds_per_batch(driver.device, density.agents);
    for (int first = 0; first < options.scenarios; first += per_batch) {
      std::vector<WorldSpec> worlds;
      for (int i = first; i < std::min(first + per_batch, options.scenarios); ++i) {
        const int scenario = options.first_scenario + i;
        worlds.push_back({scenario % static_cast<int>(maps.size()), density.agents,
                          kFirstEvaluationWorld + static_cast<uint32_t>(scenario)});
      }
      std::unique_ptr<Simulator>& simulator = shared->simulator;
      if (simulator)
        simulator->set_worlds(maps, {}, worlds, options.seed);
      else
        simulator = make_simulator(options.simulator, simulator_config, maps, worlds);
      const Driving driving = driver.drive(*simulator);
      if (options.observer) options.observer->begin(*simulator);
      const auto num_slots = static_cast<size_t>(simulator->num_slots());
      const at::Tensor command_bytes = at::zeros({static_cast<int64_t>(num_slots * sizeof(Command))},
                                                 at::TensorOptions(at::kByte).device(torch_device(driver.device)));
      const Span<Command> commands(reinterpret_cast<Command*>(command_bytes.data_ptr<uint8_t>()), num_slots);
      for (int step = 0; step < options.steps; ++step) {
        if (interrupted()) {
          report.interrupted = true;
          report.seconds = since_start.seconds();
          // The scenarios of this batch are not finished, those before are.
          if (first > 0) {
            result.scenarios.resize(static_cast<size_t>(first));
            report.rows.push_back(row_of(result, options.steps));
            report.results.densities.push_back(std::move(result));
          }
          return report;
        }
        driving.controller->act(simulator->controller_input(), {}, commands);
        // Halted agents stay as they are, so a batch is over when no agent is active.
        const int64_t num_driven = driving.num_driven();
        if (num_driven == 0) break;
        report.agent_steps += num_driven;
        if (options.observer) options.observer->before_step(commands);
        const StepResult taken = simulator->step(Span<const Command>(commands));
        if (options.observer) options.observer->after_step(taken);
        if (options.on_progress && (step % 10 == 0 || step == 1)) {
          const double fraction = (done + double(simulator->num_slots()) * (step + 1)) / work;
          // The first step compiles and tunes: how long it takes tells nothing of the others.
          if (first_s < 0) {
            first_s = since_start.seconds();
            first_fraction = fraction;
          } else {
            options.on_progress(fraction,
                                (since_start.seconds() - first_s) * (1 - fraction) / (fraction - first_fraction));
          }
        }
      }
      done += double(simulator->num_slots()) * options.steps;
      AgentState state = counted_state(*simulator);
      for (int slot = 0; slot < simulator->num_slots(); ++slot) {
        add(state.view(), slot, &result.scenarios[static_cast<size_t>(first + slot / density.agents)]);
      }
    }
    report.rows.push_back(row_of(result, options.steps));
    report.results.densities.push_back(std::move(result));
  }
  report.seconds = since_start.seconds();
  if (options.on_progress) options.on_progress(1, 0);
  return report;
}

}  // namespace

Density density_named(const std::string& name) {
  return static_cast<Density>(index_of_word("densities", name, kDensityNames));
}

CompiledMaps compile_maps_of(const EvaluateOptions& options, const SimulatorConfig& world) {
  std::vector<std::shared_ptr<const RoadMap>> roads;
  for (const std::string& name : options.maps) roads.push_back(load_map(name));
  return compile_maps(roads, map_options(world), options.num_threads);
}

SessionOptions session_options(const EvaluateOptions& options) {
  return {.num_threads = options.num_threads,
          .device = options.device,
          .simulator = options.simulator,
          .renderer = options.renderer,
          .samples = options.samples,
          .rig = options.rig,
          .width_px = options.width_px,
          .height_px = options.height_px,
          .backbone = options.backbone,
          .conditioning = options.conditioning};
}

EvaluateReport evaluate(const EvaluateOptions& options) {
  if (options.controller.empty()) {
    PolicySession session(options.checkpoint, session_options(options));
    return evaluate(&session, options);
  }
  EvaluationWorlds worlds;
  return evaluate(options, &worlds);
}

EvaluateReport evaluate(const EvaluateOptions& options, EvaluationWorlds* shared) {
  check(options);
  const Driver driver = driver_of(options.controller, options);
  if (shared->maps.empty()) shared->maps = compile_maps_of(options, driver.world);
  return evaluate(driver, options, shared);
}

EvaluateReport evaluate(PolicySession* session, const EvaluateOptions& options) {
  check(options);
  EvaluationWorlds worlds;
  worlds.maps = compile_maps_of(options, session->evaluation_world(options.steps));
  const std::unique_ptr<Renderer> renderer = session->make_renderer();
  worlds.renderer = renderer.get();
  if (renderer) upload_maps(worlds.maps, {}, renderer.get());
  return evaluate(session, options, &worlds);
}

EvaluateReport evaluate(PolicySession* session, const EvaluateOptions& options, EvaluationWorlds* shared) {
  check(options);
  return evaluate(driver_of(session, shared->renderer, options), options, shared);
}

}  // namespace pictura
