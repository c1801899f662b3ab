// The simulator's oracle: the rules of simulator/rules/ run world by world on host threads.
#pragma once

#include <memory>
#include <vector>

#include "pictura/simulator/simulator.h"

namespace pictura {

/// Throws as make_simulator says.
std::unique_ptr<Simulator> make_simulator_cpu(const SimulatorConfig& config,
                                              std::vector<std::shared_ptr<const RoadMap>> maps,
                                              std::vector<WorldSpec> worlds);

}  // namespace pictura
