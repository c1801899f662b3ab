// The worlds of a training run and the maps that they are on.
#pragma once

#include <string>
#include <vector>

#include "pictura/configuration/config.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// The worlds that fill simulator.num_slots, of all ranks; training_maps() has the map of each.
std::vector<WorldSpec> draw_training_worlds(const Config& config);

/// The maps of those worlds, as load_maps() takes them: simulator.maps, then their copies (simulator.map_copies),
/// without the copies that no world is on.
std::vector<std::string> training_maps(const Config& config);

}  // namespace pictura
