#include "pictura/training/teacher.h"

#include "pictura/backends/make_renderer.h"
#include "pictura/backends/upload_maps.h"
#include "pictura/common/error.h"
#include "pictura/policy/observation.h"
#include "pictura/policy/session.h"

namespace pictura {

namespace {

// Returns the teacher's configuration with exactly mounted cameras and the run's section `run`.
Config config_of(const SavedPolicy& saved, const Config& run) {
  Config config = with_session_options(saved.config, {});
  config.run = run.run;
  return config;
}

}  // namespace

Teacher::Teacher(const SavedPolicy& saved, const Config& config, Device device)
    : config_(config_of(saved, config)),
      rig_(saved.rig),
      chunks_{config.train.forward_chunk, config.train.reproducible},
      device_(device),
      policy_(make_policy(config_, rig_, device)) {
  // Images show no auxiliary slots. Two policies with vectors read the same slots.
  PICTURA_CHECK(config.reads_images() || config_.reads_images() || config.policy.auxiliary == config_.policy.auxiliary,
                "{}: train.teacher: its policy.auxiliary is {}, expected {}, as in the learner", saved.path,
                config_.policy.auxiliary, config.policy.auxiliary);
  restore_policy(saved, *policy_);
}

void Teacher::add_arrays(SimulatorConfig* config) const {
  config->add_observations(simulator_config(config_, device_));
}

void Teacher::enter(const Simulator& simulator) {
  if (!config_.reads_images()) return;
  renderer_ = make_renderer(config_.render.backend, renderer_config(config_, rig_, device_));
  upload_maps(simulator, renderer_.get());
}

Decision Teacher::decide(const SimulatorArrays& input, const at::Tensor& slots, bool with_scene) const {
  const auto num_slots = static_cast<int64_t>(input.slots.world_of_slot.size());
  const auto act = [&](const at::Tensor& some) {
    Observation observation = select_arrays(config_, input.observations, input.device, num_slots, some);
    if (renderer_) {
      observation.images = draw_images(input.scene, SelectedViews(input.views, device_, some).views(), renderer_.get(),
                                       policy_->drawn_patch_px());
    }
    return policy_->forward(observation);
  };
  return pictura::decide(slots, chunks_, act, with_scene ? scene_width() : 0);
}

}  // namespace pictura
