// The learning rate over a run, as a function of the agent-steps done: a rise at the start, a fall to 0 at the end.
#pragma once

#include "pictura/training/config.h"

namespace pictura {

/// The rate of an update before which `agent_steps` were done. It rises linearly from a tenth over the first
/// warm_up_agent_steps, and falls to 0, along a line or half a cosine, over the last decay_agent_steps before
/// schedule_agent_steps; a constant schedule never falls.
double learning_rate_at(const Config::Train& config, int64_t agent_steps);

/// Whether the rate has fallen to 0: there is nothing more to learn.
bool schedule_has_ended(const Config::Train& config, int64_t agent_steps);

}  // namespace pictura
