// Worlds of a training run and their maps.
#pragma once

#include <string>
#include <vector>

#include "pictura/configuration/config.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// Chooses random worlds that together have simulator.num_slots slots over all ranks. Their map indices refer to
/// training_maps(). Worlds of recorded scenes have simulator.max_agents agents each; SceneSets has their maps.
std::vector<WorldSpec> draw_training_worlds(const Config& config);

/// Returns the configuration of the worlds of draw_training_worlds(): simulator_config(), with the protocol's settings
/// for recorded scenes.
SimulatorConfig training_world(const Config& config, Device device);

/// Returns the names of the training maps, for load_maps(): first simulator.maps, then their copies
/// (simulator.map_copies), without copies that no world uses.
std::vector<std::string> training_maps(const Config& config);

}  // namespace pictura
