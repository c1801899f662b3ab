// Schedules over a run's agent-steps: of the learning rate, which rises at the start and falls to 0 at the end, of the
// policy's temperature, and of the teacher's weight.
#pragma once

#include "pictura/configuration/config.h"

namespace pictura {

/// Learning rate of an update that starts after `agent_steps`. It rises linearly from a tenth over the first
/// warm_up_agent_steps, and falls to 0, along a line or half a cosine, over the last decay_agent_steps before
/// schedule_agent_steps; a constant schedule never falls.
double learning_rate_at(const TrainSection& config, int64_t agent_steps);

/// Whether the learning rate has fallen to 0, which ends the run.
bool schedule_has_ended(const TrainSection& config, int64_t agent_steps);

/// Growth factor of logits after an update of this number of agent-steps: they double every sharpen_agent_steps, as if
/// the softmax's temperature halved. So a policy whose agents start moving only by chance has to learn to start with
/// certainty, and its most likely actions become the learnt behaviour.
double logit_growth(const TrainSection& config, int64_t agent_steps);

/// Weight of the KL divergence from the teacher's actions in an update that starts after `agent_steps`: it falls
/// linearly from teacher_coef to 0. 0 without a teacher.
double teacher_weight_at(const TrainSection& config, int64_t agent_steps);

}  // namespace pictura
