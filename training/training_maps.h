// Worlds of a training run and their maps.
#pragma once

#include <string>
#include <vector>

#include "pictura/configuration/config.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// Draws the worlds that fill simulator.num_slots, over all ranks; training_maps() has the map of each. Worlds of
/// recorded scenes have simulator.max_agents agents each; SceneSets has their maps.
std::vector<WorldSpec> draw_training_worlds(const Config& config);

/// Configuration of the worlds of draw_training_worlds(): simulator_config(), with the protocol's settings for recorded
/// scenes.
SimulatorConfig training_world(const Config& config, Device device);

/// Names of the maps of draw_training_worlds(), as load_maps() takes them: simulator.maps, then their copies
/// (simulator.map_copies), without copies that no world uses.
std::vector<std::string> training_maps(const Config& config);

}  // namespace pictura
