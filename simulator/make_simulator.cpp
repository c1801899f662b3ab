#include "pictura/common/error.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

// Each executor's one public symbol; declared here so that nothing else sees them.
std::unique_ptr<Simulator> make_cpu_simulator(const SimulatorConfig& config,
                                              std::vector<std::shared_ptr<const RoadMap>> maps,
                                              std::vector<WorldSpec> worlds);

std::unique_ptr<Simulator> make_simulator(const std::string& name, const SimulatorConfig& config,
                                          std::vector<std::shared_ptr<const RoadMap>> maps,
                                          std::vector<WorldSpec> worlds) {
  // `auto` is the CPU as long as it is the only executor of this build.
  if (name == "cpu" || name == "auto") return make_cpu_simulator(config, std::move(maps), std::move(worlds));
  fail_usage("simulator: expected one of cpu, auto, got '{}'", name);
}

}  // namespace pictura
