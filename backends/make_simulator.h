// Simulators by name: with make_renderer.h the one place that knows every backend.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// The executors of this build, and "auto".
std::vector<std::string> simulator_names();

/// Makes an executor by name, of worlds on maps that may be shared with other simulators; they must have been compiled
/// with map_options(config). The maps' handles are 0, 1, ..., see Simulator::set_worlds for others. `cuda` works on
/// config.device, or on the calling thread's current device where that is the host's. `auto` is `cuda` where
/// config.device is a CUDA device and one is found, else `cpu`; choice_out says what was chosen and why. Throws
/// UsageError listing the known names, or naming what cannot be simulated; Error where there is no device.
std::unique_ptr<Simulator> make_simulator(const std::string& name, const SimulatorConfig& config, CompiledMaps maps,
                                          std::vector<WorldSpec> worlds, std::string* choice_out = nullptr);
/// The same on maps that are compiled for this simulator alone.
std::unique_ptr<Simulator> make_simulator(const std::string& name, const SimulatorConfig& config,
                                          const std::vector<std::shared_ptr<const RoadMap>>& maps,
                                          std::vector<WorldSpec> worlds, std::string* choice_out = nullptr);

}  // namespace pictura
