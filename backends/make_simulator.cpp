#include "pictura/backends/make_simulator.h"

#include "pictura/common/error.h"
#include "pictura/simulator/simulator_setup.h"

namespace pictura {

// The only public symbol of each executor, declared here so that other files cannot see it.
std::unique_ptr<Simulator> make_cpu_simulator(SimulatorSetup setup);
#ifdef PICTURA_HAS_CUDA
std::unique_ptr<Simulator> make_cuda_simulator(SimulatorSetup setup);
/// Empty if a CUDA device is usable, else the reason why none is.
std::string cuda_unavailable();
#endif

std::vector<std::string> simulator_names() {
#ifdef PICTURA_HAS_CUDA
  return {"cpu", "cuda", "auto"};
#else
  return {"cpu", "auto"};
#endif
}

std::unique_ptr<Simulator> make_simulator(const std::string& name, const SimulatorConfig& config, CompiledMaps maps,
                                          std::vector<WorldSpec> worlds, std::string* choice_out) {
  const auto chosen = [choice_out](std::string choice) {
    if (choice_out) *choice_out = std::move(choice);
  };
  const auto setup = [&] { return SimulatorSetup(config, std::move(maps), {}, std::move(worlds)); };
  const auto make_cpu = [&] { return make_cpu_simulator(setup()); };
  if (name == "cpu") return chosen("cpu: requested"), make_cpu();
#ifdef PICTURA_HAS_CUDA
  const auto make_cuda = [&] { return make_cuda_simulator(setup()); };
  if (name == "cuda") {
    const std::string unavailable = cuda_unavailable();
    PICTURA_CHECK(unavailable.empty(), "simulator cuda: {}", unavailable);
    return chosen("cuda: requested"), make_cuda();
  }
  const std::string why_not_cuda =
      !config.device.is_host() ? cuda_unavailable() : "observations are wanted in host memory";
  if (name == "auto" && why_not_cuda.empty()) return chosen("cuda: a device was found"), make_cuda();
#else
  const std::string why_not_cuda = "this build has no CUDA";
#endif
  if (name == "auto") return chosen(fmt::format("cpu: {}", why_not_cuda)), make_cpu();
  fail_usage("simulator: expected one of {}; got '{}'", fmt::join(simulator_names(), ", "), name);
}

std::unique_ptr<Simulator> make_simulator(const std::string& name, const SimulatorConfig& config,
                                          const std::vector<std::shared_ptr<const RoadMap>>& maps,
                                          std::vector<WorldSpec> worlds, std::string* choice_out) {
  return make_simulator(name, config, compile_maps(maps, map_options(config), config.num_threads), std::move(worlds),
                        choice_out);
}

}  // namespace pictura
