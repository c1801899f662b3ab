// Actions and advantages of a rollout's agents, separately for agents at rest and agents that move. Without the
// separation an agent that has learnt to stand still looks like an agent that has learnt to drive safely.
#pragma once

#include <array>

#include "pictura/simulator/actions.h"
#include "pictura/training/ranks/communicator.h"
#include "pictura/training/rollout.h"

namespace pictura {

/// Statistics of the valid transitions of a group of agents.
struct AgentGroup {
  double kept_share = 0;      // share that the advantage filter keeps
  double mean_advantage = 0;  // before normalisation
  std::array<double, kNumActions> action_shares{};
};

struct AgentGroups {
  double rest_share = 0;  // share of valid transitions in which the agent is at rest
  AgentGroup rest, moving;
};

/// Groups the valid transitions of all ranks' rollouts, whose advantages must be computed already. The advantage filter
/// keeps a transition if its |advantage| is at least adv_threshold. Values of a group without transitions are NaN.
AgentGroups group_agents(const Rollout& rollout, double adv_threshold,
                         Communicator* communicator = single_communicator());

}  // namespace pictura
