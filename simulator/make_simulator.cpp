#include "pictura/backend_cpu/simulator_cpu.h"
#include "pictura/common/error.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

std::unique_ptr<Simulator> make_simulator(const std::string& name, const SimulatorConfig& config,
                                          std::vector<std::shared_ptr<const RoadMap>> maps,
                                          std::vector<WorldSpec> worlds) {
  // `auto` is the CPU as long as it is the only executor of this build.
  if (name == "cpu" || name == "auto") return make_simulator_cpu(config, std::move(maps), std::move(worlds));
  fail_usage("simulator: expected one of cpu, auto, got '{}'", name);
}

}  // namespace pictura
