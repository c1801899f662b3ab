// [simulator] of a configuration: the worlds of training.
#pragma once

#include <string>
#include <vector>

#include "pictura/simulator/simulator.h"

namespace pictura {

/// The simulator's own settings and which worlds there are. Settings that follow from other sections, seed and device
/// for two, count for nothing here: simulator_config() sets them.
struct SimulatorSection : SimulatorConfig {
  std::string backend = "auto";  // cpu, cuda or auto
  std::vector<std::string> maps{"Town01", "Town02", "Town03", "Town04", "Town05", "Town06", "Town07", "Town10HD"};
  int map_copies = 0;                    // affine copies of each map, beside it
  int num_slots = 20480;                 // concurrent agents, over all worlds
  int min_agents = 1, max_agents = 120;  // agents per world ~ U{min, max}
};

}  // namespace pictura
