#include "pictura/training/diagnosis.h"

#include <ATen/core/grad_mode.h>
#include <fmt/format.h>

#include "pictura/simulator/actions.h"

namespace pictura {

Scalars diagnose(const Rollout& rollout, double adv_threshold) {
  const at::NoGradGuard no_grad;
  constexpr double kSpeedScale_mps = 20;  // of ego 0, see docs/observation.md
  const at::Tensor speed_mps =
      rollout.observations.arrays().ego.narrow(0, 0, rollout.num_steps()).select(2, 0) * kSpeedScale_mps;
  const at::Tensor valid = rollout.valid.to(at::kBool), rests = speed_mps.abs() < kRest_mps;
  const at::Tensor is_kept = rollout.advantages.abs() >= adv_threshold;

  // One copy to the host: of each group its size, kept, sum of advantages, and the count of each action.
  std::vector<at::Tensor> groups;
  for (const at::Tensor& group : {valid & rests, valid & ~rests}) {
    std::vector<at::Tensor> sums{group.sum(), (group & is_kept).sum(), (rollout.advantages * group).sum(at::kDouble)};
    for (int32_t action = 0; action < kNumActions; ++action)
      sums.push_back((group & (rollout.actions == action)).sum());
    for (at::Tensor& sum : sums) sum = sum.to(at::kDouble);
    groups.push_back(at::stack(sums));
  }
  const at::Tensor host = at::stack(groups).cpu();
  const auto at = [&host](int64_t group, int64_t i) { return host[group][i].item<double>(); };

  Scalars scalars{{"agents/rest_share", at(0, 0) / (at(0, 0) + at(1, 0))}};
  const char* const names[] = {"rest", "moving"};
  for (int64_t group = 0; group < 2; ++group) {
    const auto add = [&](const std::string& name, double sum) { scalars.emplace_back(name, sum / at(group, 0)); };
    add(fmt::format("agents/kept_{}", names[group]), at(group, 1));
    add(fmt::format("agents/advantage_{}", names[group]), at(group, 2));
    for (int action = 0; action < kNumActions; ++action) {
      add(fmt::format("actions/{}_{}", names[group], action), at(group, 3 + action));
    }
  }
  return scalars;
}

}  // namespace pictura
