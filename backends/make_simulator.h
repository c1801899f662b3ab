// Simulators by name: with make_renderer.h the one place that knows every backend.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "pictura/simulator/simulator.h"

namespace pictura {

/// The executors of this build, and "auto".
std::vector<std::string> simulator_names();

/// Makes an executor by name. `auto` is `cuda` where config.space asks for it and a device is found, else `cpu`;
/// choice_out says what was chosen and why. Throws UsageError listing the known names, Error where there is no device.
std::unique_ptr<Simulator> make_simulator(const std::string& name, const SimulatorConfig& config,
                                          std::vector<std::shared_ptr<const RoadMap>> maps,
                                          std::vector<WorldSpec> worlds, std::string* choice_out = nullptr);

}  // namespace pictura
