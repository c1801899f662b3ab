#include "pictura/training/training_maps.h"

#include <algorithm>

#include "pictura/map/map_copy.h"

namespace pictura {

std::vector<WorldSpec> draw_training_worlds(const Config& config) {
  const SimulatorSection& section = config.simulator;
  return draw_worlds(config.run.seed, section.num_slots, section.min_agents, section.max_agents,
                     static_cast<int>(section.maps.size()) * (1 + section.map_copies));
}

std::vector<std::string> training_maps(const Config& config) {
  const SimulatorSection& section = config.simulator;
  std::vector<std::string> maps = with_map_copies(section.maps, section.map_copies);
  if (section.map_copies > 0) {
    maps.resize(std::min(maps.size(), std::max(section.maps.size(), draw_training_worlds(config).size())));
  }
  return maps;
}

}  // namespace pictura
