#include "pictura/bench/lane_keeping_episodes.h"

#include "pictura/backends/make_simulator.h"
#include "pictura/map/lane_graph.h"
#include "pictura/simulator/controllers/lane_keeping.h"
#include "pictura/simulator/world_batch.h"

namespace pictura {

std::vector<DrivenEpisode> drive_lane_keeping_episodes(const std::shared_ptr<const RoadMap>& map,
                                                       SimulatorConfig config, int num_worlds, int drivers_each,
                                                       int steps) {
  config.pedestrian_fraction = 0;
  config.fixed_lights = true;
  config.vector_observations = false;
  config.episode_steps = steps + 1;
  config.reset_inactive_fraction = 2;  // a world whose driver has halted stays as it is
  config.conditioning[static_cast<size_t>(Conditioning::delta_goal_m)] = {2, 2, false};
  for (size_t c = kNumRewardConditioning; c < kNumConditioning; ++c) config.conditioning[c] = {1, 1, false};
  std::vector<WorldSpec> specs;
  for (int w = 0; w < num_worlds; ++w) specs.push_back({0, drivers_each, static_cast<uint32_t>(w)});
  const auto simulator = make_simulator("cpu", config, {map}, specs);
  // The drivers' eyes: the same map, over the simulator's agents and lights.
  WorldBatch batch(config, {map}, specs);
  batch.restore(simulator->save());
  const LaneGraph graph(*map);
  std::vector<LaneKeepingController> drivers;
  for (int w = 0; w < num_worlds; ++w) {
    WorldView view = batch.world(w);
    view.agents = simulator->state();
    view.lights = const_cast<LightState*>(simulator->scene().light_states.data()) +
                  simulator->scene().light_begin[static_cast<size_t>(w)];
    for (int agent = 0; agent < drivers_each; ++agent) drivers.emplace_back(view, agent, graph);
  }
  const AgentStateView state = simulator->state();
  std::vector<int32_t> actions(drivers.size());
  for (int step = 0; step < steps; ++step) {
    for (size_t w = 0; w < drivers.size(); ++w) {
      const bool drives = state.status[w] == static_cast<uint8_t>(AgentStatus::active);
      actions[w] = drives ? drivers[w].act() : 0;
    }
    simulator->step(actions);
  }
  std::vector<DrivenEpisode> episodes;
  for (size_t w = 0; w < drivers.size(); ++w) {
    episodes.push_back({state.goals_reached[w],
                        state.halt_reason[w],
                        drivers[w].stops(),
                        drivers[w].steps_astray(),
                        state.distance_m[w],
                        {state.x_m[w], state.y_m[w]}});
  }
  return episodes;
}

}  // namespace pictura
