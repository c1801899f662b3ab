// Worlds for benchmarks, whose agents have driven for a number of steps with random actions.
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
  int num_views = 0;  // 0: one world per map, and views of all its agents
  int agents = 120;   // agents per world
  int steps = 30;
  SimulatorConfig simulator{.pedestrian_fraction = 0, .cyclist_fraction = 0, .parked_cars = 0};
};

struct DrivenWorlds {
  std::unique_ptr<Simulator> simulator;  // owns the scene and its maps
  std::vector<View> views;               // views of spawned agents: first one per world, then another per world, ...
};

/// Makes and drives enough worlds for num_views views. World 0 is on the first map, world 1 on the second, and so on,
/// cyclically. Throws Error if a map cannot be read or too few agents can be spawned.
DrivenWorlds drive_worlds(const DrivenOptions& options);

}  // namespace pictura
