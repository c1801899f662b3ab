// [simulator] of a configuration: the worlds of training.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "pictura/simulator/simulator.h"

namespace pictura {

struct SimulatorSection {
  std::string backend = "auto";  // cpu, cuda or auto
  std::vector<std::string> maps{"Town01", "Town02", "Town03", "Town04", "Town05", "Town06", "Town07", "Town10HD"};
  int map_copies = 0;                    // affine copies of each map, beside it
  int num_slots = 20480;                 // concurrent agents, over all worlds
  int min_agents = 1, max_agents = 120;  // agents per world ~ U{min, max}
  int episode_steps = 1280;
  double reset_inactive_fraction = 0.4;  // a world resets when this part of its agents is inactive
  double pedestrian_fraction = 0.1, cyclist_fraction = 0.1;
  int parked_cars = 32;  // per episode and world
  LightCycles light_cycles = LightCycles::phases;
  bool walls = true;
  uint64_t wall_seed = 0;
  LightHeads light_heads = LightHeads::as_mapped;
  bool wall_observations = false;  // the vector policy also reads the set of walls
  DynamicsRules dynamics;          // [simulator.dynamics]
  /// Training distributions: [simulator.conditioning] NAME = [low, high]; see simulator/conditioning.h for the names.
  std::array<ConditioningRange, kNumConditioning> conditioning = SimulatorConfig::default_conditioning();
};

}  // namespace pictura
