// Schedules over a run's agent-steps. The learning rate rises at the start and falls to 0 at the end. Further schedules
// control the policy's temperature and the teacher's weight.
#pragma once

#include "pictura/configuration/config.h"

namespace pictura {

/// Returns the learning rate of an update that starts after `agent_steps`. The rate rises linearly from a tenth of its
/// maximum over the first warm_up_agent_steps. It falls to 0, along a line or half a cosine, over the last
/// decay_agent_steps before schedule_agent_steps. A constant schedule never falls.
double learning_rate_at(const TrainSection& config, int64_t agent_steps);

/// Whether the learning rate has fallen to 0, which ends the run.
bool schedule_has_ended(const TrainSection& config, int64_t agent_steps);

/// Returns the factor by which logits are multiplied after an update of this number of agent-steps. Logits double every
/// sharpen_agent_steps, as if the softmax's temperature halved. If an agent starts moving only with a small
/// probability, this makes it wait even longer, so the policy learns to start.
double logit_growth(const TrainSection& config, int64_t agent_steps);

/// Returns the weight of the KL divergence from the teacher's actions in an update that starts after `agent_steps`. The
/// weight falls linearly from teacher_coef to 0; it is 0 without a teacher.
double teacher_weight_at(const TrainSection& config, int64_t agent_steps);

}  // namespace pictura
