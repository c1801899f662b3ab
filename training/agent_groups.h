// Actions and advantages of a rollout's agents, separately for agents at rest and for moving agents. A mean over both
// could not tell a policy that stands still from one that drives safely.
#pragma once

#include <array>

#include "pictura/simulator/actions.h"
#include "pictura/training/ranks/communicator.h"
#include "pictura/training/rollout.h"

namespace pictura {

/// Statistics of a group's valid transitions with new decisions.
struct AgentGroup {
  double kept_share = 0;      // kept by the advantage filter
  double mean_advantage = 0;  // before normalisation
  std::array<double, kNumActions> action_shares{};
};

struct AgentGroups {
  double rest_share = 0;  // share of valid transitions with new decisions
  AgentGroup rest, moving;
};

/// Groups the transitions of all ranks' rollouts that are valid and have new decisions. Advantages must have been
/// computed. The filter keeps transitions with |advantage| >= adv_threshold. Values of an empty group are NaN.
AgentGroups group_agents(const Rollout& rollout, double adv_threshold,
                         Communicator* communicator = single_communicator());

}  // namespace pictura
