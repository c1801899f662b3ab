#include "pictura/bench/lane_keeping_episodes.h"

#include "pictura/backends/make_simulator.h"
#include "pictura/common/support/interrupt.h"
#include "pictura/simulator/controllers/lane_keeping.h"
#include "pictura/simulator/drive_steps.h"

namespace pictura {

std::vector<DrivenEpisode> drive_lane_keeping_episodes(const std::shared_ptr<const RoadMap>& map,
                                                       SimulatorConfig config, int num_worlds, int drivers_each,
                                                       int steps) {
  config.pedestrian_fraction = 0;
  config.fixed_lights = true;
  config.vector_observations = false;
  config.episode_steps = steps + 1;
  config.reset_inactive_fraction = 2;  // so that a world continues when its agents have halted
  config.conditioning[static_cast<size_t>(Conditioning::delta_goal_m)] = {2, 2, false};
  for (size_t c = kNumRewardConditioning; c < kNumConditioning; ++c) config.conditioning[c] = {1, 1, false};
  std::vector<WorldSpec> specs;
  for (int w = 0; w < num_worlds; ++w) specs.push_back({0, drivers_each, static_cast<uint32_t>(w)});
  const auto simulator = make_simulator("cpu", config, {map}, specs);
  LaneKeepingController controller(*simulator);
  if (drive_steps(*simulator, controller, steps).is_interrupted) throw_if_interrupted();
  const AgentStateView state = simulator->state();
  std::vector<DrivenEpisode> episodes;
  for (size_t slot = 0; slot < static_cast<size_t>(simulator->num_slots()); ++slot) {
    const LaneKeepingAgent* agent = controller.agent(slot);
    episodes.push_back({state.goals_reached[slot],
                        state.halt_reason[slot],
                        agent ? agent->stops() : 0,
                        agent ? agent->steps_off_path() : 0,
                        state.distance_m[slot],
                        {state.x_m[slot], state.y_m[slot]}});
  }
  return episodes;
}

}  // namespace pictura
