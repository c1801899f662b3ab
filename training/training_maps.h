// Worlds of a training run and their maps.
#pragma once

#include <string>
#include <vector>

#include "pictura/configuration/config.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// Draws worlds with simulator.num_slots slots over all ranks. Their map indices refer to training_maps(), except in
/// recorded scenes, whose maps SceneSets has.
std::vector<WorldSpec> draw_training_worlds(const Config& config);

/// Returns simulator_config(), with the protocol's settings for recorded scenes.
SimulatorConfig training_world(const Config& config, Device device);

/// Returns names for load_maps(): simulator.maps, then copies (simulator.map_copies) that worlds use.
std::vector<std::string> training_maps(const Config& config);

}  // namespace pictura
