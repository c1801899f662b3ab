// Schedules over a run's agent-steps: of the learning rate, with a rise at the start and a fall to 0 at the end, of the
// policy's temperature, and of a teacher's weight.
#pragma once

#include "pictura/configuration/config.h"

namespace pictura {

/// Learning rate of an update before which `agent_steps` were done. It rises linearly from a tenth over the first
/// warm_up_agent_steps, and falls to 0, along a line or half a cosine, over the last decay_agent_steps before
/// schedule_agent_steps; a constant schedule never falls.
double learning_rate_at(const TrainSection& config, int64_t agent_steps);

/// Whether the learning rate has fallen to 0, which ends the run.
bool schedule_has_ended(const TrainSection& config, int64_t agent_steps);

/// Factor by which logits grow after an update of so many agent-steps: they double every sharpen_agent_steps, as if
/// the softmax's temperature halved. So a policy that starts by chance has to learn to start for certain, and its
/// likeliest actions become what it has learnt by.
double logit_growth(const TrainSection& config, int64_t agent_steps);

/// Weight of the KL divergence from the teacher's actions in an update before which `agent_steps` were done: it falls
/// from teacher_coef to 0 along a line. 0 without a teacher.
double teacher_weight_at(const TrainSection& config, int64_t agent_steps);

}  // namespace pictura
