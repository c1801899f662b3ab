// What the agents of a rollout did, apart for those at rest and those that move: an agent that has learnt to stand
// still looks like one that has learnt to drive safely, unless the two are told apart.
#pragma once

#include <array>

#include "pictura/simulator/actions.h"
#include "pictura/training/ranks/communicator.h"
#include "pictura/training/rollout.h"

namespace pictura {

/// Of the valid transitions of some agents.
struct AgentGroup {
  double kept_share = 0;      // that the advantage filter keeps
  double mean_advantage = 0;  // before it is normalised
  std::array<double, kNumActions> action_shares{};
};

struct Diagnosis {
  double rest_share = 0;  // valid transitions of agents at rest over all
  AgentGroup rest, moving;
};

/// Of a rollout with advantages, of all ranks, under a filter that keeps those of at least adv_threshold. A group
/// without agents has NaN.
Diagnosis diagnose(const Rollout& rollout, double adv_threshold, Communicator* communicator = alone());

}  // namespace pictura
