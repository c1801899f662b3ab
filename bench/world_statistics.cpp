#include "pictura/bench/world_statistics.h"

#include <algorithm>
#include <limits>

#include <fmt/format.h>

#include "pictura/backends/make_controller.h"
#include "pictura/backends/make_simulator.h"
#include "pictura/bench/lane_keeping_episodes.h"
#include "pictura/common/support/interrupt.h"
#include "pictura/simulator/controllers/goal_places.h"
#include "pictura/simulator/controllers/lane_keeping.h"
#include "pictura/simulator/drive_steps.h"
#include "pictura/simulator/host_worlds.h"

namespace pictura {

namespace {

/// Counted quantities, in the order in which they were first counted.
class Counts {
 public:
  explicit Counts(int episodes) : episodes_(static_cast<size_t>(episodes)) {}

  double& of(const std::string& name, const std::string& unit, size_t episode) {
    auto found = std::find_if(all_.begin(), all_.end(), [&name](const EpisodeValues& v) { return v.name == name; });
    if (found == all_.end()) found = all_.insert(all_.end(), {name, unit, std::vector<double>(episodes_)});
    return found->values[episode];
  }
  std::vector<EpisodeValues> take() { return std::move(all_); }

 private:
  size_t episodes_;
  std::vector<EpisodeValues> all_;
};

/// Counts placed agents, unplaced agents by reason, and unreachable goals.
void count_population(HostWorlds& worlds, const LaneGraph& graph, Counts* counts_inout) {
  constexpr const char* kClasses[kNumAgentClasses] = {"vehicles", "cyclists", "pedestrians"};
  static_assert(static_cast<int>(AgentClass::cyclist) == 1 && static_cast<int>(AgentClass::pedestrian) == 2);
  for (int w = 0; w < worlds.setup.num_worlds(); ++w) {
    const WorldView world = worlds.world(w);
    const auto episode = static_cast<size_t>(w);
    const auto count = [&](const char* name, const char* unit, double value) {
      counts_inout->of(name, unit, episode) += value;
    };
    for (const char* name : kClasses) count(name, "agents", 0);
    count("refused, places taken", "agents", 0);
    count("refused, no place", "agents", 0);
    for (int agent = 0; agent < world.num_agents; ++agent) {
      const int slot = world.first_slot + agent;
      switch (world.agents.refusal[slot]) {
        case SpawnFailure::none: count(kClasses[static_cast<int>(world.agents.agent_class[slot])], "agents", 1); break;
        case SpawnFailure::taken: count("refused, places taken", "agents", 1); break;
        case SpawnFailure::no_place: count("refused, no place", "agents", 1); break;
      }
    }
    for (int i = world.num_agents; i < world.num_boxes; ++i) count("parked cars", "cars", world.boxes[i].drawn);
    const auto [on_roads, on_walkways] = follow_goals(world, graph, 1);
    count("waypoints of the first chains", "waypoints",
          static_cast<double>(on_roads.waypoints + on_walkways.waypoints));
    count("unreachable waypoints of the first chains", "waypoints",
          static_cast<double>(on_roads.unreachable + on_walkways.unreachable));
    throw_if_interrupted();
  }
}

void count_random_policy(Simulator& simulator, const WorldStatisticsOptions& options, Counts* counts_inout) {
  constexpr std::pair<const char*, Event> kEvents[] = {
      {"random policy: collisions", kEventCollision}, {"random policy: of these at fault", kEventAtFault},
      {"random policy: off-road", kEventOffRoad},     {"random policy: wall contacts", kEventWall},
      {"random policy: red lights", kEventRedLight},  {"random policy: goals", kEventMetricGoal}};
  const AgentStateView state = simulator.state();
  const std::vector<WorldSpec>& worlds = simulator.worlds();
  const auto controller = make_controller("random", simulator, options.seed);
  std::vector<Command> commands(static_cast<size_t>(simulator.num_slots()));
  const auto in_first_episode = [](int32_t episode) { return episode == 0; };
  std::vector<int32_t> episode;
  const auto act = [&](int) {
    const Span<const int32_t> before = simulator.episode_index();
    episode.assign(before.begin(), before.end());
    controller->act(simulator.arrays(), {}, commands);
    return std::any_of(episode.begin(), episode.end(), in_first_episode);
  };
  const auto on_step = [&](int step, const StepResult& result) {
    size_t slot = 0;
    for (size_t w = 0; w < worlds.size(); ++w) {
      const bool counts = episode[w] == 0 && simulator.episode_index()[w] == 0;
      counts_inout->of("random policy: steps", "steps", w) += counts;
      for (const size_t end = slot + static_cast<size_t>(worlds[w].num_agents); slot < end; ++slot) {
        for (const auto& [name, event] : kEvents) {
          counts_inout->of(name, "agents", w) += counts && result.valid[slot] && (state.events[slot] & event) != 0;
        }
      }
    }
    if (options.on_progress && step % 10 == 0) options.on_progress(fmt::format("random policy, step {}", step));
  };
  constexpr int kEndless = std::numeric_limits<int>::max();
  if (drive_steps(simulator, commands, kEndless, act, {}, on_step).is_interrupted) throw_if_interrupted();
}

void drive_lanes(const std::shared_ptr<const RoadMap>& map, const SimulatorConfig& config, int episodes,
                 Counts* counts_inout) {
  static_assert(LaneKeepingAgent::kOffPath_m == 1);
  constexpr std::pair<const char*, Event> kReasons[] = {{"lane driver: collisions", kEventCollision},
                                                        {"lane driver: off-road", kEventOffRoad},
                                                        {"lane driver: wall contacts", kEventWall},
                                                        {"lane driver: red lights", kEventRedLight}};
  const auto driven = drive_lane_keeping_episodes(map, config, episodes, 1, config.episode_steps);
  for (size_t w = 0; w < driven.size(); ++w) {
    counts_inout->of("lane driver: goals", "goals", w) = driven[w].goals;
    counts_inout->of("lane driver: distance", "m", w) = driven[w].distance_m;
    counts_inout->of("lane driver: wait at red lights", "s", w) = driven[w].stops * static_cast<double>(config.dt_s);
    counts_inout->of("lane driver: more than 1 m from its path", "s", w) =
        driven[w].steps_off_path * static_cast<double>(config.dt_s);
    for (const auto& [name, event] : kReasons) {
      counts_inout->of(name, "drivers", w) = (driven[w].halt_reason & event) != 0;
    }
  }
}

}  // namespace

std::vector<EpisodeValues> measure_worlds(const std::shared_ptr<const RoadMap>& map,
                                          const WorldStatisticsOptions& options) {
  const auto say = [&options](const std::string& phase) {
    if (options.on_progress) options.on_progress(phase);
  };
  SimulatorConfig config;
  config.seed = options.seed;
  config.num_threads = options.num_threads;
  config.vector_observations = false;
  std::vector<WorldSpec> worlds;
  for (int w = 0; w < options.episodes; ++w) worlds.push_back({0, options.agents, static_cast<uint32_t>(w)});
  const auto simulator = make_simulator("cpu", config, {map}, worlds);
  Counts counts(options.episodes);
  say("goals");
  HostWorlds first_step(SimulatorSetup(config, simulator->maps(), {}, worlds));
  first_step.state.restore(first_step.setup, simulator->save());
  count_population(first_step, LaneGraph(*map), &counts);
  count_random_policy(*simulator, options, &counts);
  say("lane driver");
  config.cyclist_fraction = 0;
  drive_lanes(map, config, options.episodes, &counts);
  return counts.take();
}

}  // namespace pictura
