// Worlds whose agents have driven with random actions.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "pictura/simulator/simulator.h"

namespace pictura {

/// `simulator` must be in host memory.
void step_randomly(Simulator* simulator, uint64_t seed, int steps);

struct DrivenOptions {
  std::vector<std::string> maps;
  int num_views = 0;  // 0: one world per map, and views of all its agents
  int agents = 120;   // per world
  int steps = 30;
  SimulatorConfig simulator{.pedestrian_fraction = 0, .cyclist_fraction = 0, .parked_cars = 0};
};

struct DrivenWorlds {
  std::unique_ptr<Simulator> simulator;
  std::vector<View> views;  // views of spawned agents, from each world in turn
};

/// Makes and drives enough worlds for num_views views. The worlds use the maps in turn. Throws Error if a map cannot be
/// read or too few agents can be spawned.
DrivenWorlds drive_worlds(const DrivenOptions& options);

}  // namespace pictura
