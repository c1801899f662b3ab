#include "pictura/training/ppo.h"

#include <cmath>
#include <numbers>

#include <ATen/core/grad_mode.h>

#include "pictura/common/error.h"
#include "pictura/training/rules/advantage_filter.h"
#include "pictura/training/torch_device.h"

namespace pictura {

float AdvantageFilter::threshold(float max_advantage, double ema, double fraction) {
  average = filter_average(average, max_advantage, ema);
  return filter_threshold(average, fraction);
}

AdamW::AdamW(const Policy& policy, const Config::Train& config) : parameters_(policy.parameters()), config_(config) {
  for (const NamedTensor& parameter : parameters_) {
    first_moments.push_back({parameter.name, at::zeros_like(parameter.value)});
    second_moments.push_back({parameter.name, at::zeros_like(parameter.value)});
  }
}

at::Tensor AdamW::step(double learning_rate) {
  const at::NoGradGuard no_grad;
  std::vector<at::Tensor> values, gradients, first, second;
  for (size_t i = 0; i < parameters_.size(); ++i) {
    // Those that no loss depended on (an unused camera, say) have none.
    at::Tensor gradient = parameters_[i].value.mutable_grad();
    if (!gradient.defined()) continue;
    values.push_back(parameters_[i].value);
    gradients.push_back(gradient);
    first.push_back(first_moments[i].value);
    second.push_back(second_moments[i].value);
  }
  const at::Tensor norm = at::stack(at::_foreach_norm(gradients, 2)).norm();
  at::_foreach_mul_(gradients, (config_.max_grad_norm / (norm + 1e-6)).clamp_max(1.0));
  ++steps;
  const std::vector<at::Tensor> counts(values.size(), at::full({}, static_cast<double>(steps), norm.options()));
  at::_fused_adamw_(values, gradients, first, second, {}, counts, learning_rate, config_.adam_beta1, config_.adam_beta2,
                    config_.weight_decay, config_.adam_eps, /*amsgrad=*/false, /*maximize=*/false);
  for (const NamedTensor& parameter : parameters_) parameter.value.mutable_grad().reset();
  return norm;
}

double cosine_rate(double learning_rate, int64_t update, int64_t schedule_updates) {
  const double done = std::min(1.0, static_cast<double>(update) / static_cast<double>(schedule_updates));
  return learning_rate * 0.5 * (1.0 + std::cos(std::numbers::pi * done));
}

namespace {

// 1 - Var(returns - values) / Var(returns): 1 is a perfect critic, 0 one that says a constant.
double explained_variance(const at::Tensor& values, const at::Tensor& returns) {
  const double variance = returns.var().item<double>();
  return variance > 0 ? 1 - (returns - values).var().item<double>() / variance : 0;
}

}  // namespace

UpdateStats ppo_update(const Policy& policy, const Rollout& rollout, const Config::Train& config, uint64_t seed,
                       int64_t update, LearnerExecutor* executor, AdamW* optimizer, AdvantageFilter* filter,
                       PhaseTimer* timer) {
  UpdateStats stats;
  // The batch: transitions of all agents and steps, flattened.
  const at::Tensor actions = rollout.actions.flatten().to(at::kLong), old_log_probs = rollout.log_probs.flatten();
  const at::Tensor advantages = rollout.advantages.flatten();
  const at::Tensor values = rollout.values.narrow(0, 0, rollout.num_steps()).flatten();
  const at::Tensor returns = advantages + values;

  // Filter, once per rollout.
  const float max_advantage = advantages.abs().max().item<float>();
  PICTURA_CHECK(std::isfinite(max_advantage), "update {}: an advantage is not finite", update + 1);
  const float threshold = filter->threshold(max_advantage, config.adv_filter_ema, config.adv_filter_threshold);
  stats.adv_threshold = static_cast<double>(threshold);
  const at::Tensor valid = rollout.valid.flatten();
  const at::Tensor kept_and_unused = at::empty_like(advantages, at::kLong);
  const int64_t num_kept = executor->select_kept(span_of<const float>(advantages), span_of<const uint8_t>(valid),
                                                 threshold, span_of<int64_t>(kept_and_unused));
  const at::Tensor kept = kept_and_unused.narrow(0, 0, num_kept), shuffled = at::empty_like(kept);
  const int64_t num_valid = valid.sum().item<int64_t>();
  if (num_kept == 0) return stats;
  stats.kept_fraction = static_cast<double>(num_kept) / static_cast<double>(num_valid);
  stats.explained_variance = explained_variance(values.index_select(0, kept), returns.index_select(0, kept));

  const double rate = cosine_rate(config.learning_rate, update, config.schedule_updates);
  const int64_t num_minibatches = (num_kept + config.minibatch_size - 1) / config.minibatch_size;
  at::Tensor sums = at::zeros({6}, advantages.options().dtype(at::kDouble));
  for (int epoch = 0; epoch < config.update_epochs; ++epoch) {
    executor->permute(Permutation(seed, update, epoch, num_kept), span_of<const int64_t>(kept),
                      span_of<int64_t>(shuffled));
    for (int64_t m = 0; m < num_minibatches; ++m) {
      // Minibatches of equal size, to one transition.
      const int64_t begin = num_kept * m / num_minibatches, end = num_kept * (m + 1) / num_minibatches;
      const at::Tensor minibatch = shuffled.narrow(0, begin, end - begin);
      at::Tensor minibatch_advantages = advantages.index_select(0, minibatch);
      if (config.norm_adv && end - begin > 1) {
        minibatch_advantages =
            (minibatch_advantages - minibatch_advantages.mean()) / (minibatch_advantages.std() + 1e-8);
      }

      for (int64_t chunk = 0; chunk < end - begin; chunk += config.forward_chunk) {
        const int64_t size = std::min(config.forward_chunk, end - begin - chunk);
        const double weight = static_cast<double>(size) / static_cast<double>(end - begin);
        const at::Tensor rows = minibatch.narrow(0, chunk, size);
        const at::Tensor advantage = minibatch_advantages.narrow(0, chunk, size);

        const Observation observation = rollout.observations.gather(rows);
        const PhaseTimer::Scope timed(timer, Phase::learn);
        const Policy::Output output = policy.forward(observation);
        const at::Tensor all_log_probs = at::log_softmax(output.logits, 1);
        const at::Tensor log_prob = all_log_probs.gather(1, actions.index_select(0, rows).unsqueeze(1)).squeeze(1);
        const at::Tensor log_ratio = log_prob - old_log_probs.index_select(0, rows);
        const at::Tensor ratio = log_ratio.exp();
        const at::Tensor clipped = ratio.clamp(1 - config.clip_coef, 1 + config.clip_coef);

        const at::Tensor policy_loss = -at::minimum(advantage * ratio, advantage * clipped).mean();
        const at::Tensor value_loss = 0.5 * (output.value - returns.index_select(0, rows)).square().mean();
        const at::Tensor entropy = -(all_log_probs.exp() * all_log_probs).sum(1).mean();
        const at::Tensor loss = policy_loss + config.vf_coef * value_loss - config.ent_coef * entropy;
        (loss * weight).backward();

        const at::NoGradGuard no_grad;
        // Schulman's estimator of the KL divergence, (ratio - 1) - log ratio: unbiased and never negative.
        const at::Tensor approx_kl = (ratio - 1 - log_ratio).mean();
        const at::Tensor clip_fraction = ((ratio - 1).abs() > config.clip_coef).to(at::kFloat).mean();
        sums.narrow(0, 0, 5) +=
            weight * at::stack({policy_loss, value_loss, entropy, approx_kl, clip_fraction}).detach().to(at::kDouble);
      }
      const PhaseTimer::Scope timed(timer, Phase::optimize);
      sums[5] += optimizer->step(rate);
      ++stats.minibatches;
    }
  }

  double* const means[] = {&stats.policy_loss, &stats.value_loss,    &stats.entropy,
                           &stats.approx_kl,   &stats.clip_fraction, &stats.grad_norm};
  const at::Tensor all = (sums / static_cast<double>(stats.minibatches)).cpu();
  for (int64_t i = 0; i < 6; ++i) *means[i] = all[i].item<double>();
  PICTURA_CHECK(std::isfinite(stats.policy_loss + stats.value_loss + stats.entropy) && std::isfinite(stats.grad_norm),
                "update {}: the loss is not finite (policy {}, value {}, entropy {}, gradient norm {})", update + 1,
                stats.policy_loss, stats.value_loss, stats.entropy, stats.grad_norm);
  return stats;
}

}  // namespace pictura
