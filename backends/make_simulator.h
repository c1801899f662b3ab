// Makes simulators by name. Only make_simulator.cpp refers to all simulator backends.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// Returns the names of this build's simulators, and "auto".
std::vector<std::string> simulator_names();

/// Makes a simulator by name. Several simulators may share the maps, which must have been compiled with
/// map_options(config). The maps' handles are 0, 1, ...; Simulator::set_worlds can set other handles. "cuda" works on
/// config.device, or on the calling thread's current device if config.device is the host. "auto" is "cuda" if
/// config.device is a CUDA device and a usable CUDA device is found, else "cpu". If choice_out is not null, it receives
/// the choice and its reason. Throws UsageError for an unknown name and for settings, maps or worlds that cannot be
/// simulated, and Error if the device does not exist.
std::unique_ptr<Simulator> make_simulator(const std::string& name, const SimulatorConfig& config, CompiledMaps maps,
                                          std::vector<WorldSpec> worlds, std::string* choice_out = nullptr);
/// Compiles the maps, and makes a simulator that does not share them.
std::unique_ptr<Simulator> make_simulator(const std::string& name, const SimulatorConfig& config,
                                          const std::vector<std::shared_ptr<const RoadMap>>& maps,
                                          std::vector<WorldSpec> worlds, std::string* choice_out = nullptr);

}  // namespace pictura
