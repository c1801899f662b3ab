#include "pictura/cli/drive.h"

#include <algorithm>

#include "pictura/backends/make_controller.h"
#include "pictura/backends/make_renderer.h"
#include "pictura/backends/make_simulator.h"
#include "pictura/backends/upload_maps.h"
#include "pictura/cli/finite_range.h"
#include "pictura/common/error.h"
#include "pictura/map/load_map.h"
#include "pictura/simulator/controllers/host_controllers.h"
#ifdef PICTURA_HAS_TORCH
#include "pictura/training/session.h"
#endif

namespace pictura {

void add_world_options(CLI::App* command, WorldOptions* options_out) {
  command->add_option("--agents", options_out->agents, "Vehicles, cyclists and pedestrians in the world")
      ->check(CLI::Range(1, kMaxAgentsPerWorld))
      ->capture_default_str();
  // What a command sets beforehand is its default; else the policy decides, or the simulator.
  const SimulatorConfig simulator;
  auto with_default = [](const char* what, auto preset, auto simulators) {
    return fmt::format("{}; default: {}{}", what, preset ? "" : "as the policy was trained, else ",
                       preset.value_or(simulators));
  };
  command
      ->add_option("--pedestrians", options_out->pedestrian_fraction,
                   with_default("Share of the agents", options_out->pedestrian_fraction, simulator.pedestrian_fraction))
      ->check(finite_range(0, 1));
  command
      ->add_option("--cyclists", options_out->cyclist_fraction,
                   with_default("Share of the agents", options_out->cyclist_fraction, simulator.cyclist_fraction))
      ->check(finite_range(0, 1));
  command
      ->add_option("--parked", options_out->parked_cars,
                   with_default("Parked cars", options_out->parked_cars, simulator.parked_cars))
      ->check(CLI::Range(0, kMaxAgentsPerWorld));
  command->add_option("--seed", options_out->seed, "Places, sizes, goals and actions")->capture_default_str();
  command->add_option("--threads", options_out->num_threads, "Host threads; 0: all")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command->add_flag("!--no-walls", options_out->walls, "Leave out the walls along the building lines");
}

namespace {

#ifdef PICTURA_HAS_TORCH
/// A trained policy, for the simulator that it was given to.
class PolicyController final : public Controller {
 public:
  PolicyController(const std::string& checkpoint, const std::string& backend, int num_threads)
      : driver_(load_driver(checkpoint, num_threads)) {
    if (driver_->needs_images()) {
      renderer_ = make_renderer(backend, {.rig = driver_->rig(), .num_threads = num_threads});
    }
  }
  std::string_view name() const override { return "policy"; }
  void adapt(SimulatorConfig* config_inout) const {
    const SimulatorConfig known = driver_->evaluation_world();
    config_inout->conditioning = known.conditioning;
    config_inout->auxiliary_observations = known.auxiliary_observations;
    config_inout->vector_observations = known.vector_observations;
    config_inout->walls = config_inout->walls && known.walls;
    config_inout->pedestrian_fraction = known.pedestrian_fraction;
    config_inout->cyclist_fraction = known.cyclist_fraction;
    config_inout->parked_cars = known.parked_cars;
  }
  void enter(Simulator* simulator) {
    simulator_ = simulator;
    actions_.resize(static_cast<size_t>(simulator->num_slots()));
    if (renderer_) upload_maps(*simulator, renderer_.get());
  }
  void act(const ControllerInput&, Span<const uint8_t> mask, Span<Command> commands_out, Stream) override {
    driver_->act(*simulator_, renderer_.get(), /*argmax=*/true, actions_);
    for (size_t slot = 0; slot < commands_out.size(); ++slot) {
      if (!mask.empty() && !mask[slot]) continue;
      commands_out[slot] = {};
      commands_out[slot].action = actions_[slot];
    }
  }

 private:
  std::unique_ptr<Driver> driver_;
  std::unique_ptr<Renderer> renderer_;
  Simulator* simulator_ = nullptr;
  std::vector<int32_t> actions_;
};
#endif

}  // namespace

DrivenWorld make_world(const WorldOptions& options, const std::string& policy,
                       [[maybe_unused]] const std::string& backend) {
  SimulatorConfig config;
  config.seed = options.seed;
  config.num_threads = options.num_threads;
  config.walls = options.walls;
  config.fixed_lights = true;
  config.vector_observations = options.vector_observations;
  const std::vector<std::string> names = host_controller_names();
  const bool is_named = std::find(names.begin(), names.end(), policy) != names.end();
#ifdef PICTURA_HAS_TORCH
  std::unique_ptr<PolicyController> trained;
  if (!is_named) {
    trained = std::make_unique<PolicyController>(policy, backend, options.num_threads);
    trained->adapt(&config);
  }
#else
  if (!is_named) {
    fail_usage("--policy: expected {} (this build has no torch for checkpoints), got '{}'", fmt::join(names, ", "),
               policy);
  }
#endif
  config.pedestrian_fraction = options.pedestrian_fraction.value_or(config.pedestrian_fraction);
  config.cyclist_fraction = options.cyclist_fraction.value_or(config.cyclist_fraction);
  config.parked_cars = options.parked_cars.value_or(config.parked_cars);
  DrivenWorld world;
  world.simulator = make_simulator("cpu", config, {load_map(options.map)}, {{0, options.agents, 0}});
  world.commands.resize(static_cast<size_t>(world.simulator->num_slots()));
#ifdef PICTURA_HAS_TORCH
  if (trained) {
    trained->enter(world.simulator.get());
    world.controller = std::move(trained);
  }
#endif
  if (!world.controller) world.controller = make_controller(policy, *world.simulator, options.seed);
  return world;
}

}  // namespace pictura
