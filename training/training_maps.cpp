#include "pictura/training/training_maps.h"

#include <algorithm>

#include "pictura/configuration/apply_config.h"
#include "pictura/evaluation/evaluate_scenes.h"
#include "pictura/map/map_copy.h"

namespace pictura {

std::vector<WorldSpec> draw_training_worlds(const Config& config) {
  const SimulatorSection& section = config.simulator;
  if (section.has_scenes()) {
    return draw_worlds(config.run.seed, section.num_slots, section.max_agents, section.max_agents, /*num_maps=*/1);
  }
  return draw_worlds(config.run.seed, section.num_slots, section.min_agents, section.max_agents,
                     static_cast<int>(section.maps.size()) * (1 + section.map_copies));
}

SimulatorConfig training_world(const Config& config, Device device) {
  SimulatorConfig world = simulator_config(config, device);
  if (!config.simulator.has_scenes()) return world;
  const SceneProtocol protocol = config.simulator.scenes.training_protocol();
  world = protocol_config(protocol, world);
  world.episode_steps = std::min(config.simulator.episode_steps, protocol.steps);
  world.reset_inactive_fraction = 1;
  world.parked_cars = config.simulator.scenes.max_replayed;
  return world;
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
