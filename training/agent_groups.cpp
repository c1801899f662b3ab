#include "pictura/training/agent_groups.h"

#include <ATen/core/grad_mode.h>

#include "pictura/simulator/rules/observe.h"

namespace pictura {

AgentGroups group_agents(const Rollout& rollout, double adv_threshold, Communicator* communicator) {
  const at::NoGradGuard no_grad;
  const at::Tensor speed_mps =
      rollout.observations.arrays().ego.narrow(0, 0, rollout.num_steps()).select(2, 0) * kScaleSpeed_mps;
  const at::Tensor valid = rollout.decisions().to(at::kBool), rests = speed_mps.abs() <= kRest_mps;
  const at::Tensor is_kept = rollout.advantages.abs() >= adv_threshold;

  // A single copy to the host contains, for each group, its size, the number of kept transitions, the sum of
  // advantages, and the count of each action.
  std::vector<at::Tensor> groups;
  for (const at::Tensor& group : {valid & rests, valid & ~rests}) {
    std::vector<at::Tensor> sums{group.sum(), (group & is_kept).sum(), (rollout.advantages * group).sum(at::kDouble)};
    for (int32_t action = 0; action < kNumActions; ++action)
      sums.push_back((group & (rollout.actions == action)).sum());
    for (at::Tensor& sum : sums) sum = sum.to(at::kDouble);
    groups.push_back(at::stack(sums));
  }
  const at::Tensor of_all = at::stack(groups);
  communicator->sum(of_all);
  const at::Tensor host = of_all.cpu();
  const auto group = [&host](int64_t index) {
    const double* const sums = host.const_data_ptr<double>() + index * host.size(1);
    AgentGroup result{sums[1] / sums[0], sums[2] / sums[0], {}};
    for (size_t action = 0; action < kNumActions; ++action) result.action_shares[action] = sums[3 + action] / sums[0];
    return result;
  };
  const double resting = host[0][0].item<double>(), moving = host[1][0].item<double>();
  return {resting / (resting + moving), group(0), group(1)};
}

}  // namespace pictura
