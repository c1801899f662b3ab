#include "pictura/evaluation/evaluated_driver.h"

#include <algorithm>
#include <optional>

#include "pictura/backends/make_controller.h"
#include "pictura/backends/make_renderer.h"
#include "pictura/backends/upload_maps.h"
#include "pictura/common/error.h"
#include "pictura/common/pixel_samples.h"
#include "pictura/configuration/apply_config.h"
#include "pictura/configuration/compare_configs.h"
#include "pictura/configuration/config.h"
#include "pictura/policy/learning_device.h"
#include "pictura/policy/session.h"
#include "pictura/policy/stored_policy.h"
#include "pictura/simulator/controllers/host_controllers.h"
#include "pictura/simulator/hash_values.h"

namespace pictura {

int64_t count_active(Simulator& simulator) {
  const Span<const AgentStatus> status(simulator.state().status, static_cast<size_t>(simulator.num_slots()));
  const std::vector<AgentStatus> all = host_copy(status, simulator.device());
  return std::count(all.begin(), all.end(), AgentStatus::active);
}

std::unique_ptr<PolicyController> policy_controller(PolicySession& session, Renderer* renderer,
                                                    const DriverOptions& options, const Simulator& simulator) {
  const bool hides_auxiliary =
      simulator.config().auxiliary_observations && !session.training_world().auxiliary_observations;
  return session.make_controller(renderer, options.argmax, options.seed, hides_auxiliary);
}

namespace {

void add_images(const Config& config, const Rig& rig, double camera_severity, EvaluationSetting* setting) {
  setting->renderer = config.render.backend;
  setting->samples = text_of(config.render.samples);
  setting->camera_severity = camera_severity;
  Hash64 cameras;
  for (const Camera& camera : rig.cameras) {
    setting->image_sizes.push_back(fmt::format("{}x{}", camera.width_px, camera.height_px));
    add_values(&cameras, camera.focal_x_px, camera.focal_y_px, camera.center_x_px, camera.center_y_px,
               camera.position_m.x, camera.position_m.y, camera.position_m.z, camera.yaw_rad, camera.pitch_rad,
               camera.roll_rad);
  }
  setting->cameras_hash = cameras.hex();
}

}  // namespace

EvaluationSetting setting_of(const PolicySession& session) {
  const Config& config = session.config();
  const bool is_on_host = session.device().is_host();
  EvaluationSetting setting;
  setting.policy_hash = session.policy_hash();
  setting.config = keys_of_evaluation(config, /*has_policy=*/true);
  setting.conditioning = config.evaluate.conditioning;
  setting.light_cycles = config.simulator.light_cycles;
  setting.device = is_on_host ? "cpu" : "cuda";
  setting.precision = is_on_host ? "fp32" : name_of(config.train.precision);
  if (session.reads_images()) add_images(config, session.rig(), session.camera_severity(), &setting);
  return setting;
}

EvaluatedDriver policy_driver(PolicySession* session, Renderer* renderer, const DriverOptions& options, int steps) {
  return {session->evaluation_world(steps), setting_of(*session), session->device(),
          [session, renderer, &options](Simulator& simulator) {
            std::unique_ptr<PolicyController> controller = policy_controller(*session, renderer, options, simulator);
            const PolicyController* const policy = controller.get();
            return Driving{std::move(controller), [policy] { return policy->num_driven(); }};
          }};
}

EvaluatedDriver controller_driver(const DriverOptions& options, int steps) {
  if (options.decision_steps > 0)
    fail_usage("decision_steps: expected a trained policy, got the controller {}", options.controller);
  const bool is_own = options.make_own_controller != nullptr;
  const std::optional<Rig> rig = is_own ? named_rig(options) : std::nullopt;
  Config config = options.checkpoint.empty() ? Config() : read_stored_policy(options.checkpoint).config;
  config.policy.modality = rig ? Modality::perspective : Modality::vector;
  config = with_session_options(config, options);
  config.policy.modality = is_own ? Modality::vector : Modality::perspective;  // other controllers read no vectors;
  if (!rig) config.render.backend = "auto";                                    // without cameras, nothing is drawn
  const std::string& name = options.controller;
  const bool is_on_host = is_own || drives_on_host(name);
  if (is_on_host && options.device == "auto" && options.simulator == "auto") config.run.device = "cpu";
  EvaluatedDriver driver;
  driver.device = open_learning_device(config);
  driver.world = evaluation_simulator_config(config, steps, driver.device);
  driver.setting.policy_hash = name;
  driver.setting.conditioning = config.evaluate.conditioning;
  driver.setting.config = keys_of_evaluation(config, /*has_policy=*/false);
  driver.setting.light_cycles = config.simulator.light_cycles;
  driver.setting.device = driver.device.is_host() ? "cpu" : is_on_host ? "cuda, driven from the host" : "cuda";
  if (!is_own) {
    driver.drive = [&options](Simulator& simulator) {
      return Driving{make_controller(options.controller, simulator, options.seed),
                     [&simulator] { return count_active(simulator); }};
    };
    return driver;
  }
  std::shared_ptr<Renderer> renderer;
  if (rig) {
    add_images(config, *rig, options.camera_severity, &driver.setting);
    renderer = make_renderer(config.render.backend, evaluation_renderer_config(config, *rig, driver.device));
  }
  driver.drive = [&options, renderer](Simulator& simulator) {
    if (renderer) upload_maps(simulator, renderer.get());
    return Driving{options.make_own_controller(options, simulator, renderer.get()),
                   [&simulator] { return count_active(simulator); }};
  };
  return driver;
}

}  // namespace pictura
