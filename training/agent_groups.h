// Actions and advantages of a rollout's agents, apart for those at rest and those that move: an agent that has learnt
// to stand still looks like one that has learnt to drive safely, unless the two are told apart.
#pragma once

#include <array>

#include "pictura/simulator/actions.h"
#include "pictura/training/ranks/communicator.h"
#include "pictura/training/rollout.h"

namespace pictura {

/// Valid transitions of some agents.
struct AgentGroup {
  double kept_share = 0;      // share that the advantage filter keeps
  double mean_advantage = 0;  // before normalisation
  std::array<double, kNumActions> action_shares{};
};

struct AgentGroups {
  double rest_share = 0;  // valid transitions of agents at rest over all
  AgentGroup rest, moving;
};

/// Groups the agents of a rollout with advantages, of all ranks, under a filter that keeps |advantages| of at least
/// adv_threshold. A group without agents has NaN.
AgentGroups group_agents(const Rollout& rollout, double adv_threshold, Communicator* communicator = alone());

}  // namespace pictura
