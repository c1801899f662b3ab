#include "pictura/training/losses.h"

#include <ATen/core/grad_mode.h>

#include "pictura/common/error.h"
#include "pictura/policy/value_head.h"

namespace pictura {

namespace {

at::Tensor mean_of(const at::Tensor& values, const at::Tensor& shares) {
  return shares.defined() ? (values * shares).mean() : values.mean();
}

// The value's loss of each row.
at::Tensor value_losses(const Policy::Output& output, const at::Tensor& returns) {
  switch (output.value_head) {
    case ValueHead::linear: return 0.5 * (output.value - returns).square();
    case ValueHead::symlog: return 0.5 * (output.value_outputs.squeeze(1) - symlog(returns)).square();
    case ValueHead::two_hot: return -(two_hot(returns) * at::log_softmax(output.value_outputs, 1)).sum(1);
  }
  fail("losses: unknown value head");
}

}  // namespace

at::Tensor log_probs_of(const at::Tensor& all_log_probs, const Targets& targets, const at::Tensor& rows) {
  // A sum of which all but one are 0: the gradient of gather() waits for the host where algorithms are deterministic.
  const at::Tensor actions = targets.actions.index_select(0, rows).unsqueeze(1);
  return all_log_probs.masked_fill(at::arange(all_log_probs.size(1), actions.options()) != actions, 0).sum(1);
}

Losses losses_of(const Policy::Output& output, const Targets& targets, const at::Tensor& rows,
                 const at::Tensor& advantages, const at::Tensor& shares, double clip_coef) {
  const at::Tensor all_log_probs = at::log_softmax(output.logits, 1);
  const at::Tensor log_prob = log_probs_of(all_log_probs, targets, rows);
  const at::Tensor log_ratio = log_prob - targets.old_log_probs.index_select(0, rows);
  const at::Tensor ratio = log_ratio.exp();
  const at::Tensor clipped = ratio.clamp(1 - clip_coef, 1 + clip_coef);
  Losses losses;
  losses.policy = -mean_of(at::minimum(advantages * ratio, advantages * clipped), shares);
  losses.value = mean_of(value_losses(output, targets.returns.index_select(0, rows)), shares);
  losses.entropy = -mean_of((all_log_probs.exp() * all_log_probs).sum(1), shares);
  at::Tensor teacher_kl = at::zeros({}, losses.entropy.options());
  if (targets.teacher_log_probs.defined()) {
    const at::Tensor teacher = targets.teacher_log_probs.index_select(0, rows);
    teacher_kl = mean_of((teacher.exp() * (teacher - all_log_probs)).sum(1), shares);
    losses.imitation = targets.teacher_weight * teacher_kl;
  }
  const at::NoGradGuard no_grad;
  // Schulman's estimator of the KL divergence, (ratio - 1) - log ratio: unbiased and never negative.
  const at::Tensor approx_kl = mean_of(ratio - 1 - log_ratio, shares);
  const at::Tensor clip_fraction = mean_of(((ratio - 1).abs() > clip_coef).to(at::kFloat), shares);
  losses.stats = at::stack({losses.policy, losses.value, losses.entropy, approx_kl, clip_fraction,
                            mean_of(log_ratio.abs(), shares), teacher_kl})
                     .detach()
                     .to(at::kDouble);
  return losses;
}

}  // namespace pictura
