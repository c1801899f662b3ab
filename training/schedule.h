// Schedules over a run's agent-steps.
#pragma once

#include "pictura/configuration/config.h"

namespace pictura {

/// Learning rate of an update that starts after `agent_steps`. It rises linearly from a tenth of its maximum over
/// warm_up_agent_steps. Over the last decay_agent_steps before schedule_agent_steps it falls to 0, along a line or half
/// a cosine, unless the schedule is constant.
double learning_rate_at(const TrainSection& config, int64_t agent_steps);

/// Whether the learning rate has fallen to 0, which ends the run.
bool schedule_has_ended(const TrainSection& config, int64_t agent_steps);

/// Factor for logits after an update of this number of agent-steps: logits double every sharpen_agent_steps. In
/// training, larger logits make an agent that rarely chooses to start wait even longer. Waiting costs return, so the
/// policy learns to start.
double logit_growth(const TrainSection& config, int64_t agent_steps);

/// Weight of the teacher's KL divergence in an update that starts after `agent_steps`. It falls linearly from
/// teacher_coef to 0; it is 0 without a teacher.
double teacher_weight_at(const TrainSection& config, int64_t agent_steps);

}  // namespace pictura
