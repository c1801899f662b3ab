#include "pictura/cli/drive.h"

#include "pictura/backends/make_renderer.h"
#include "pictura/backends/make_simulator.h"
#include "pictura/cli/finite_range.h"
#include "pictura/common/error.h"
#include "pictura/common/rng.h"
#include "pictura/map/load_map.h"
#ifdef PICTURA_HAS_TORCH
#include "pictura/training/training.h"
#endif

namespace pictura {

void add_world_options(CLI::App* command, WorldOptions* options_out) {
  command->add_option("--agents", options_out->agents, "Vehicles, cyclists and pedestrians in the world")
      ->check(CLI::Range(1, kMaxAgentsPerWorld))
      ->capture_default_str();
  // What a command sets beforehand is its default; else who drives decides, or the simulator.
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

class RandomPilot final : public Pilot {
 public:
  explicit RandomPilot(uint64_t seed) : seed_(seed) {}
  void act(Simulator&, Span<int32_t> actions_out) override {
    for (size_t slot = 0; slot < actions_out.size(); ++slot) {
      RandomStream random(seed_, 0, static_cast<uint32_t>(slot), 0, step_, Purpose::action);
      actions_out[slot] = random.below(kNumActions);
    }
    ++step_;
  }

 private:
  uint64_t seed_;
  uint32_t step_ = 0;
};

class IdlePilot final : public Pilot {
 public:
  void act(Simulator&, Span<int32_t> actions_out) override {
    constexpr int kNoJerk = 2 * kNumLatActions + 1;
    for (int32_t& action : actions_out) action = kNoJerk;
  }
};

#ifdef PICTURA_HAS_TORCH
class PolicyPilot final : public Pilot {
 public:
  PolicyPilot(const std::string& checkpoint, const std::string& backend, int num_threads)
      : driver_(load_driver(checkpoint, num_threads)) {
    if (driver_->needs_images()) {
      renderer_ = make_renderer(backend, {.rig = driver_->rig(), .num_threads = num_threads});
    }
  }
  void adapt(SimulatorConfig* config_inout) const override {
    const SimulatorConfig known = driver_->evaluation_world();
    config_inout->conditioning = known.conditioning;
    config_inout->auxiliary_observations = known.auxiliary_observations;
    config_inout->vector_observations = known.vector_observations;
    config_inout->walls = config_inout->walls && known.walls;
    config_inout->pedestrian_fraction = known.pedestrian_fraction;
    config_inout->cyclist_fraction = known.cyclist_fraction;
    config_inout->parked_cars = known.parked_cars;
  }
  void enter(const Simulator& simulator) override {
    if (renderer_) upload_geometries(simulator.geometries(), renderer_.get());
  }
  void act(Simulator& simulator, Span<int32_t> actions_out) override {
    driver_->act(simulator, renderer_.get(), /*argmax=*/true, actions_out);
  }

 private:
  std::unique_ptr<Driver> driver_;
  std::unique_ptr<Renderer> renderer_;
};
#endif

}  // namespace

std::unique_ptr<Pilot> make_pilot(const std::string& name, uint64_t seed, [[maybe_unused]] const std::string& backend,
                                  [[maybe_unused]] int num_threads) {
  if (name == "random") return std::make_unique<RandomPilot>(seed);
  if (name == "idle") return std::make_unique<IdlePilot>();
#ifdef PICTURA_HAS_TORCH
  return std::make_unique<PolicyPilot>(name, backend, num_threads);
#else
  fail_usage("--policy: expected random or idle (this build has no torch for checkpoints), got '{}'", name);
#endif
}

std::unique_ptr<Simulator> make_world(const WorldOptions& options, Pilot* pilot) {
  SimulatorConfig config;
  config.seed = options.seed;
  config.num_threads = options.num_threads;
  config.walls = options.walls;
  config.fixed_lights = true;
  config.vector_observations = options.vector_observations;
  pilot->adapt(&config);
  config.pedestrian_fraction = options.pedestrian_fraction.value_or(config.pedestrian_fraction);
  config.cyclist_fraction = options.cyclist_fraction.value_or(config.cyclist_fraction);
  config.parked_cars = options.parked_cars.value_or(config.parked_cars);
  auto simulator = make_simulator("cpu", config, {load_map(options.map)}, {{0, options.agents, 0}});
  pilot->enter(*simulator);
  return simulator;
}

}  // namespace pictura
