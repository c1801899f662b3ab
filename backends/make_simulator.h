// Creates simulators from their names.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// Returns the names of this build's simulators, and "auto".
std::vector<std::string> simulator_names();

/// Makes a simulator. The maps must be compiled with map_options(config); several simulators may share them. Map i has
/// the handle i. "cuda" works on config.device, or on the current CUDA device if config.device is the host. "auto"
/// chooses as in make_renderer(). choice_out receives the choice and its reason. Throws UsageError for an unknown name
/// and for settings, maps or worlds that cannot be simulated, and Error if the device does not exist.
std::unique_ptr<Simulator> make_simulator(const std::string& name, const SimulatorConfig& config, CompiledMaps maps,
                                          std::vector<WorldSpec> worlds, std::string* choice_out = nullptr);
/// Compiles the maps first.
std::unique_ptr<Simulator> make_simulator(const std::string& name, const SimulatorConfig& config,
                                          const std::vector<std::shared_ptr<const RoadMap>>& maps,
                                          std::vector<WorldSpec> worlds, std::string* choice_out = nullptr);

}  // namespace pictura
