// Worlds for benchmarks: agents of many worlds, driven for a number of steps with random actions.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "pictura/simulator/simulator.h"

namespace pictura {

/// Steps a simulator in host memory with the random controller.
void step_randomly(Simulator* simulator, uint64_t seed, int steps);

struct DrivenOptions {
  std::vector<std::string> maps;
  int num_views = 0;  // 0: one world per map, with views of all its agents
  int agents = 120;   // per world
  int steps = 30;
  SimulatorConfig simulator{.pedestrian_fraction = 0, .cyclist_fraction = 0, .parked_cars = 0};
};

struct DrivenWorlds {
  std::unique_ptr<Simulator> simulator;  // owns the scene and its maps
  std::vector<View> views;               // views of placed agents: one per world, then the next of each world
};

/// Makes and drives enough worlds for the views, on the maps in turn. Throws Error when a map cannot be read, or too
/// few agents find a place.
DrivenWorlds drive_worlds(const DrivenOptions& options);

}  // namespace pictura
