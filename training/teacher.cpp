#include "pictura/training/teacher.h"

#include "pictura/common/error.h"
#include "pictura/configuration/apply_config.h"

namespace pictura {

Teacher::Teacher(const SavedPolicy& saved, const Config& config, Device device)
    : config_(saved.config),
      chunks_{config.train.forward_chunk, config.train.reproducible},
      device_(device),
      policy_(make_policy(saved.config, saved.rig, device)) {
  PICTURA_CHECK(!config_.reads_images(),
                "{}: train.teacher: its policy reads images, expected a policy of the modality \"vector\"", saved.path);
  // A learner with images does not read auxiliary slots. Two policies with vectors read the same slots.
  PICTURA_CHECK(config.reads_images() || config.policy.auxiliary == config_.policy.auxiliary,
                "{}: train.teacher: its policy.auxiliary is {}, expected {}, as in the learner", saved.path,
                config_.policy.auxiliary, config.policy.auxiliary);
  restore_policy(saved, *policy_);
}

void Teacher::add_arrays(SimulatorConfig* config) const {
  const SimulatorConfig own = simulator_config(config_, device_);
  config->vector_observations = true;
  config->auxiliary_observations = own.auxiliary_observations;
  config->wall_observations = config->wall_observations || own.wall_observations;
}

at::Tensor Teacher::log_probs(const SimulatorArrays& input, const at::Tensor& slots) const {
  const auto num_slots = static_cast<int64_t>(input.slots.world_of_slot.size());
  return decide(slots, chunks_,
                [&](const at::Tensor& some) {
                  return policy_->forward(select_arrays(config_, input.observations, input.device, num_slots, some));
                })
      .log_probs;
}

}  // namespace pictura
