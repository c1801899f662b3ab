// CPU simulators for tests.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "pictura/backends/make_simulator.h"
#include "pictura/tests/simulator/same_bits.h"

namespace pictura::testing {

inline std::unique_ptr<Simulator> make(const SimulatorConfig& config, std::shared_ptr<const RoadMap> map,
                                       std::vector<WorldSpec> worlds) {
  return make_simulator("cpu", config, {std::move(map)}, std::move(worlds));
}

/// Takes `steps` steps with mixed_actions(), numbered from `first_step`.
inline void run(Simulator* simulator, int steps, uint32_t first_step = 0) {
  for (int i = 0; i < steps; ++i) {
    simulator->step(mixed_actions(simulator->num_slots(), first_step + static_cast<uint32_t>(i)));
  }
}

}  // namespace pictura::testing
