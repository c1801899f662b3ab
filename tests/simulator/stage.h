// A world in which a test places agents.
#pragma once

#include <memory>

#include "pictura/simulator/host_worlds.h"
#include "pictura/simulator/rules/observe.h"
#include "pictura/simulator/rules/spawn.h"
#include "pictura/simulator/rules/step.h"
#include "pictura/tests/simulator/test_maps.h"

namespace pictura::testing {

constexpr int32_t kCoast = 2 * kNumLatActions + 1;  // no jerk

class Stage {
 public:
  /// Makes num_agents vehicles of 4 x 2 m, absent until put(). Conditioning has the lower ends of the paper's ranges,
  /// dynamics multipliers are 1, and lights are green.
  Stage(std::shared_ptr<const RoadMap> map, int num_agents, const SimulatorConfig& config = cars());

  /// Places an agent with its rear axle at position_m, and finds its lane.
  void put(int agent, Vec2 position_m, float heading_rad, float speed_mps);
  void set(int agent, Conditioning which, float value);
  /// Steps all agents with one action. Returns the rewards.
  std::vector<float> step(int32_t action = kCoast);
  int events(int agent) const { return worlds.state.agents.events[agent]; }
  WorldView world() { return worlds.world(0); }

  HostWorlds worlds;
  HostResults results;

 protected:
  void sort_boxes();
};

}  // namespace pictura::testing
