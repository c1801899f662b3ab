#include "pictura/evaluation/evaluate.h"

#include <algorithm>

#include "pictura/backends/make_simulator.h"
#include "pictura/backends/upload_maps.h"
#include "pictura/common/error.h"
#include "pictura/common/support/hash.h"
#include "pictura/common/support/suggestion.h"
#include "pictura/evaluation/mixed_traffic.h"
#include "pictura/evaluation/progress.h"
#include "pictura/evaluation/standing.h"
#include "pictura/map/load_map.h"
#include "pictura/map/map_cache.h"
#include "pictura/policy/learning_device.h"
#include "pictura/policy/session.h"
#include "pictura/simulator/agent_state.h"
#include "pictura/simulator/drive_steps.h"

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

// Number of worlds simulated together. On a GPU, for the paper's densities, it is at least 200, the number of scenarios
// per density; 200 worlds saturate the GPU. Images do not limit this number, because they are drawn for only
// train.forward_chunk agents at a time.
int worlds_per_batch(Device device, int agents_per_world) {
  const int max_agents = device.is_host() ? 4096 : 32768;
  return std::max(1, max_agents / agents_per_world);
}

// Copies the fields of the agents' state from which counts are computed to the host. All other fields of the result are
// empty.
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
  copy(state.first_motion_step, &host.first_motion_step);
  copy(state.episode_return, &host.episode_return);
  copy(state.refusal, &host.refusal);
  copy(state.life, &host.life);
  copy(state.left, &host.left);
  return host;
}

// Adds a vehicle's life to the counts: the agent has left or halted, or the last step ends its life.
void add_life(const AgentStateView& state, int64_t slot, ScenarioCounts* counts) {
  const AgentStatus status = state.status[slot];
  if (state.agent_class[slot] != AgentClass::vehicle) return;
  const uint8_t events = state.episode_events[slot];
  const auto has = [events](int any_of) { return (events & any_of) != 0; };
  ++counts->vehicles;
  counts->collision += has(kEventCollision);
  counts->at_fault += has(kEventAtFault);
  counts->off_road += has(kEventOffRoad);
  counts->red_light += has(kEventRedLight);
  counts->wall_contact += has(kEventWall);
  counts->any_infraction += has(kEventCollision | kEventOffRoad | kEventRedLight);
  counts->at_fault_infraction += has(kEventAtFault | kEventOffRoad | kEventRedLight);
  counts->active_at_end += status == AgentStatus::active || status == AgentStatus::waiting;
  counts->never_moved += state.first_motion_step[slot] == 0;
  counts->goals += state.goals_reached[slot];
  counts->waypoints += state.waypoints_reached[slot];
  counts->distance_m += static_cast<double>(state.distance_m[slot]);
  counts->returns += static_cast<double>(state.episode_return[slot]);
}

// Adds a slot to the counts after the last step. Earlier agents of the slot, which left, are already counted.
void add_slot(const AgentStateView& state, int64_t slot, ScenarioCounts* counts) {
  const AgentStatus status = state.status[slot];
  const bool waits = status == AgentStatus::waiting;
  ++counts->asked;
  counts->spawned += state.refusal[slot] == SpawnFailure::none;
  counts->entered += state.life[slot];
  counts->left += state.life[slot] + waits;
  if (has_body(status)) add_life(state, slot, counts);
}

// Returns the severity of the worst infraction in a vehicle's episode; 0 without an infraction, and for other agents.
int severity(const AgentStateView& state, int slot) {
  if (state.agent_class[slot] != AgentClass::vehicle) return 0;
  const uint8_t events = state.episode_events[slot];
  return (events & kEventAtFault) ? 3 : (events & kEventOffRoad) ? 2 : (events & kEventRedLight) ? 1 : 0;
}

// Returns for each world the agent with the most severe infraction, the first if several are equal. Each world has
// `agents_per_world` slots.
std::vector<int> worst_agents(const AgentStateView& state, int num_slots, int agents_per_world) {
  std::vector<int> worst;
  for (int begin = 0; begin < num_slots; begin += agents_per_world) {
    int gravest = 0;
    for (int agent = 1; agent < agents_per_world; ++agent) {
      if (severity(state, begin + agent) > severity(state, begin + gravest)) gravest = agent;
    }
    worst.push_back(gravest);
  }
  return worst;
}

bool has_lives(const Simulator& simulator) {
  const CompiledMaps& maps = simulator.maps();
  return std::any_of(maps.begin(), maps.end(), [](const auto& map) { return map->rules.is_open; });
}

// Whether an agent is still waiting to enter.
bool is_awaited(Simulator& simulator) {
  if (!has_lives(simulator)) return false;
  const Span<const AgentStatus> status(simulator.state().status, static_cast<size_t>(simulator.num_slots()));
  const std::vector<AgentStatus> all = host_copy(status, simulator.device());
  return std::find(all.begin(), all.end(), AgentStatus::waiting) != all.end();
}

std::string hash_of(const CompiledMaps& maps) {
  Hash64 hash;
  for (const auto& map : maps) {
    const std::string roads = encode_map(*map->road, {});
    hash.add_bytes(roads.data(), roads.size());
  }
  return hash.hex();
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

// Returns the worlds of at most `count` of the options' scenarios, from the index `first` on. Scenarios cycle through
// the maps.
std::vector<WorldSpec> worlds_of(const EvaluateOptions& options, size_t num_maps, int agents, int first, int count) {
  std::vector<WorldSpec> worlds;
  for (int i = first; i < std::min(first + count, options.scenarios); ++i) {
    const int scenario = options.first_scenario + i;
    worlds.push_back(
        {scenario % static_cast<int>(num_maps), agents, kFirstEvaluationWorld + static_cast<uint32_t>(scenario)});
  }
  return worlds;
}

// Drives the simulator's worlds from the start of their episodes to the last step. Stops earlier if no agent is active
// or waits to enter, because halted agents remain halted. Returns false after an interrupt. Calls on_steps occasionally
// with the number of completed steps, and on_left(state, slot) for each agent that left a road that ends.
template <typename OnSteps, typename OnLeft>
bool drive_to_the_end(const Driving& driving, const EvaluateOptions& options, Simulator* simulator,
                      const OnSteps& on_steps, const OnLeft& on_left, StandingObserver* standing,
                      int64_t* agent_steps_inout) {
  EvaluationObserver* const observer = options.observer;
  std::vector<StepObserver*> observers{standing};
  if (observer) {
    observer->begin(*simulator);
    observers.push_back(observer);
  }
  DeviceCopy<Command> command_memory(std::vector<Command>(static_cast<size_t>(simulator->num_slots())),
                                     simulator->device());
  const Span<Command> commands = command_memory.span();
  const auto act = [&](int) {
    driving.controller->act(simulator->arrays(), {}, commands);
    const int64_t num_driven = driving.num_driven();
    *agent_steps_inout += num_driven;
    return num_driven > 0 || is_awaited(*simulator);
  };
  const auto on_step = [&](int step, const StepResult&) {
    if (has_lives(*simulator)) {
      AgentState state = counted_state(*simulator);
      for (size_t slot = 0; slot < state.left.size(); ++slot) {
        if (state.left[slot] != 0) on_left(state.view(), static_cast<int64_t>(slot));
      }
    }
    if (step % 10 == 0 || step == 1) on_steps(step + 1);
  };
  if (drive_steps(*simulator, commands, options.steps, act, observers, on_step).is_interrupted) return false;
  if (observer) observer->end();
  return true;
}

EvaluateReport evaluate(const EvaluatedDriver& driver, const EvaluateOptions& options, EvaluationWorlds* shared) {
  const CompiledMaps& maps = shared->maps;
  const MixedTraffic traffic(other_drivers(options.others), options, driver.device, maps);
  SimulatorConfig simulator_config = traffic.adapted(driver.world);
  simulator_config.seed = options.seed;
  std::vector<DensityOf> densities;
  if (options.agents_per_world > 0)
    densities.push_back({"custom", options.agents_per_world});
  else
    for (const Density density : options.densities) densities.push_back(density_of(density));
  double work = 0, done = 0;  // agents times steps
  for (const DensityOf& density : densities) work += double(density.agents) * options.scenarios * options.steps;

  EvaluationClock clock(options.on_progress);
  EvaluateReport report;
  report.results.setting = driver.setting;
  EvaluationSetting& setting = report.results.setting;
  setting.maps = options.maps;
  if (shared->maps_hash.empty()) shared->maps_hash = hash_of(maps);
  setting.maps_hash = shared->maps_hash;
  setting.steps = options.steps;
  setting.argmax = options.argmax;
  setting.seed = options.seed;
  setting.light_heads = name_of(maps.front()->options.light_heads);
  setting.others = traffic.setting();
  for (const DensityOf& density : densities) {
    std::vector<DensityResult> results;  // by driver
    for (size_t i = 0; i < traffic.num_drivers(); ++i) {
      results.push_back({density.name, density.agents, options.first_scenario, {}, traffic.name(i)});
      results.back().scenarios.resize(static_cast<size_t>(options.scenarios));
    }
    const int per_batch = worlds_per_batch(driver.device, density.agents);
    for (int first = 0; first < options.scenarios && !report.interrupted; first += per_batch) {
      const std::vector<WorldSpec> worlds = worlds_of(options, maps.size(), density.agents, first, per_batch);
      std::unique_ptr<Simulator>& simulator = shared->simulator;
      if (simulator)
        simulator->set_worlds(maps, {}, worlds, options.seed);
      else
        simulator = make_simulator(options.simulator, simulator_config, maps, worlds);
      const auto num_slots = double(simulator->num_slots());
      const auto on_steps = [&](int steps) { clock.update((done + num_slots * steps) / work); };
      const std::vector<uint8_t> driver_of_slot = traffic.driver_of_slots(*simulator);
      const auto counts_of = [&](int64_t slot) {
        DensityResult& result = results[driver_of_slot[static_cast<size_t>(slot)]];
        return &result.scenarios[static_cast<size_t>(first + slot / density.agents)];
      };
      const auto on_left = [&](const AgentStateView& state, int64_t slot) { add_life(state, slot, counts_of(slot)); };
      StandingObserver standing(*simulator, driver_of_slot, traffic.num_drivers());
      const Driving driving = traffic.share(driver.drive(*simulator), *simulator, driver_of_slot);
      if (!drive_to_the_end(driving, options, simulator.get(), on_steps, on_left, &standing, &report.agent_steps)) {
        report.interrupted = true;
        for (DensityResult& result : results) {
          result.scenarios.resize(static_cast<size_t>(first));  // scenarios of completed batches
        }
        break;
      }
      done += num_slots * options.steps;
      AgentState state = counted_state(*simulator);
      for (int slot = 0; slot < simulator->num_slots(); ++slot) {
        add_slot(state.view(), slot, counts_of(slot));
      }
      const std::vector<int> worst = worst_agents(state.view(), simulator->num_slots(), density.agents);
      for (DensityResult& result : results) {
        result.worst_agents.insert(result.worst_agents.end(), worst.begin(), worst.end());
      }
      for (size_t i = 0; i < results.size(); ++i) {
        const std::vector<StandingCounts> stood = standing.counts(i);
        for (size_t world = 0; world < stood.size(); ++world) {
          results[i].scenarios[static_cast<size_t>(first) + world].standing = stood[world];
        }
      }
    }
    for (DensityResult& result : results) {
      if (result.scenarios.empty()) continue;
      report.rows.push_back(row_of(result, options.steps));
      report.results.densities.push_back(std::move(result));
    }
    if (report.interrupted) break;
  }
  report.seconds = clock.seconds();
  if (!report.interrupted) clock.finish();
  return report;
}

}  // namespace

Density density_named(const std::string& name) {
  return static_cast<Density>(index_of_word("densities", name, kDensityNames));
}

CompiledMaps compile_maps_of(const EvaluateOptions& options, const SimulatorConfig& world) {
  return compile_maps(load_maps(options.maps, options.num_threads), map_options(world), options.num_threads);
}

EvaluateReport evaluate(const EvaluateOptions& options) {
  if (options.controller.empty()) {
    PolicySession session(options.checkpoint, options);
    return evaluate(&session, options);
  }
  EvaluationWorlds worlds;
  return evaluate(options, &worlds);
}

EvaluateReport evaluate(const EvaluateOptions& options, EvaluationWorlds* shared) {
  check(options);
  const EvaluatedDriver driver = controller_driver(options, options.steps);
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
  return evaluate(policy_driver(session, shared->renderer, options, options.steps), options, shared);
}

}  // namespace pictura
