#include "pictura/training/evaluation/evaluated_driver.h"

#include <algorithm>

#include "pictura/backends/make_controller.h"
#include "pictura/common/error.h"
#include "pictura/simulator/controllers/host_controllers.h"
#include "pictura/training/config.h"
#include "pictura/training/config_keys.h"
#include "pictura/training/saved_policy.h"
#include "pictura/training/session.h"
#include "pictura/training/torch_device.h"

namespace pictura {

namespace {

int64_t count_active(Simulator& simulator) {
  const Span<const uint8_t> status(simulator.state().status, static_cast<size_t>(simulator.num_slots()));
  const std::vector<uint8_t> all = host_copy(status, simulator.device());
  return std::count(all.begin(), all.end(), static_cast<uint8_t>(AgentStatus::active));
}

}  // namespace

SessionOptions session_options(const DriverOptions& options) {
  return {.num_threads = options.num_threads,
          .device = options.device,
          .simulator = options.simulator,
          .renderer = options.renderer,
          .samples = options.samples,
          .rig = options.rig,
          .width_px = options.width_px,
          .height_px = options.height_px,
          .backbone = options.backbone,
          .conditioning = options.conditioning,
          .adds_walls = options.adds_walls,
          .average = options.average,
          .light_cycles = options.light_cycles,
          .light_heads = options.light_heads};
}

EvaluatedDriver policy_driver(PolicySession* session, Renderer* renderer, const DriverOptions& options, int steps) {
  return {session->evaluation_world(steps), session->evaluation_setting(), session->device(),
          [session, renderer, &options](Simulator&) {
            std::unique_ptr<PolicyController> controller =
                session->make_controller(renderer, options.argmax, options.seed);
            const PolicyController* const policy = controller.get();
            return Driving{std::move(controller), [policy] { return policy->num_driven(); }};
          }};
}

EvaluatedDriver controller_driver(const DriverOptions& options, int steps) {
  Config config = options.checkpoint.empty() ? Config() : read_policy(options.checkpoint).config;
  config = with_evaluate_conditioning(config, options.conditioning);
  config.policy.modality = Modality::perspective;  // nobody reads vectors,
  config.render.backend = "auto";                  // and nothing is drawn
  config.run.num_threads = options.num_threads;
  config.run.device = options.device;
  config.simulator.backend = options.simulator;
  config.simulator.walls |= options.adds_walls;
  config.simulator.light_cycles = options.light_cycles.value_or(config.simulator.light_cycles);
  config.simulator.light_heads = options.light_heads.value_or(config.simulator.light_heads);
  const std::string& name = options.controller;
  const bool is_on_host = drives_on_host(name);
  if (is_on_host && options.device == "auto" && options.simulator == "auto") config.run.device = "cpu";
  EvaluatedDriver driver;
  driver.device = open_learning_device(config);
  driver.world = evaluation_simulator_config(config, steps, driver.device);
  driver.setting.policy_hash = name;
  driver.setting.conditioning = config.evaluate.conditioning;
  driver.setting.config = keys_of_evaluation(config, /*has_policy=*/false);
  driver.setting.light_cycles = config.simulator.light_cycles;
  driver.setting.device = driver.device.is_host() ? "cpu" : is_on_host ? "cuda, driven from the host" : "cuda";
  driver.drive = [&options](Simulator& simulator) {
    return Driving{make_controller(options.controller, simulator, options.seed),
                   [&simulator] { return count_active(simulator); }};
  };
  return driver;
}

}  // namespace pictura
