// What the agents of a rollout did, apart for those at rest and those that move: an agent that has learnt to stand
// still looks like one that has learnt to drive safely, unless the two are told apart.
#pragma once

#include "pictura/training/event_file.h"
#include "pictura/training/rollout.h"

namespace pictura {

constexpr double kRest_mps = 0.3;  // agents slower than this are at rest

/// Over the valid transitions: share of agents at rest; and of those at rest and those that move, the share that an
/// advantage filter with this threshold keeps, the mean advantage, and how often each action was chosen.
Scalars diagnose(const Rollout& rollout, double adv_threshold);

}  // namespace pictura
