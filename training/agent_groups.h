// Actions and advantages of a rollout's agents, separately for agents at rest and agents that move. Without the
// separation an agent that has learnt to stand still looks like an agent that has learnt to drive safely.
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

/// Groups the agents of all ranks' rollouts with advantages, under a filter that keeps |advantages| of at least
/// adv_threshold. A group without agents has NaN.
AgentGroups group_agents(const Rollout& rollout, double adv_threshold,
                         Communicator* communicator = single_communicator());

}  // namespace pictura
