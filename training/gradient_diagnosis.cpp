#include "pictura/training/gradient_diagnosis.h"

#include <algorithm>

#include "pictura/training/ppo.h"

namespace pictura {

void GradientDiagnosis::measure(const Minibatch& first, const Minibatches& minibatches, const LossFunction& loss,
                                const TrainSection& config, const Learner& learner) {
  constexpr int64_t kPassesPerDiagnosed = 100, kMaxDiagnosed = 1024;
  const int64_t num_diagnosed =
      std::clamp<int64_t>(minibatches.global_size() * config.update_epochs / kPassesPerDiagnosed, 1,
                          std::min({kMaxDiagnosed, config.forward_chunk, first.global_size}));
  const at::Tensor rows = first.rows.narrow(0, 0, minibatches.count_own_among_first(num_diagnosed));
  const at::Tensor& gradient = learner.optimizer->gradients();
  // For each loss: sum of its gradients, then the number of transitions, so that ranks add both at once.
  const at::Tensor sums = at::zeros({3, gradient.numel() + 1}, gradient.options());
  sums.select(1, -1).fill_(rows.size(0));
  // There is a single chunk, or none if all transitions belong to other ranks.
  for_each_chunk(rows, {config.forward_chunk}, [&](const Chunk& chunk) {
    const Losses losses = learner.runner->losses(first.part(chunk), loss);
    const PhaseTimer::Scope timed(learner.timer, Phase::diagnose);
    const at::Tensor single_losses[] = {config.policy_coef * losses.policy, config.vf_coef * losses.value,
                                        config.ent_coef * losses.entropy};
    for (int64_t i = 0; i < 3; ++i) {
      single_losses[i].backward(/*gradient=*/{}, /*retain_graph=*/true);
      sums[i].narrow(0, 0, gradient.numel()).copy_(gradient).mul_(rows.size(0));
      learner.optimizer->clear_gradients();
    }
  });
  const PhaseTimer::Scope timed(learner.timer, Phase::diagnose);
  learner.communicator->sum(sums);
  norms_ = (sums.slice(1, 0, -1).norm(2, {1}) / sums.select(1, -1)).to(at::kDouble);
}

GradientNorms GradientDiagnosis::norms() const {
  const at::Tensor host = norms_.cpu();
  const double* const values = host.const_data_ptr<double>();
  return {values[0], values[1], values[2]};
}

}  // namespace pictura
