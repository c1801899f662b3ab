// Simulators by name. With make_renderer.h, this file alone knows every backend.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// Returns the executors of this build, and "auto".
std::vector<std::string> simulator_names();

/// Makes an executor by name, of worlds on maps that may be shared with other simulators; the maps must have been
/// compiled with map_options(config). The maps' handles are 0, 1, ..., see Simulator::set_worlds for others. `cuda`
/// works on config.device, or on the calling thread's current device if config.device is the host. `auto` is `cuda` if
/// config.device is a CUDA device and such a device is found, else `cpu`; choice_out gets the choice and its reason.
/// Throws UsageError listing the known names, or naming parts that cannot be simulated; Error if the device does not
/// exist.
std::unique_ptr<Simulator> make_simulator(const std::string& name, const SimulatorConfig& config, CompiledMaps maps,
                                          std::vector<WorldSpec> worlds, std::string* choice_out = nullptr);
/// Makes an executor on maps that are compiled for this simulator alone.
std::unique_ptr<Simulator> make_simulator(const std::string& name, const SimulatorConfig& config,
                                          const std::vector<std::shared_ptr<const RoadMap>>& maps,
                                          std::vector<WorldSpec> worlds, std::string* choice_out = nullptr);

}  // namespace pictura
