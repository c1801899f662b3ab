#include "pictura/training/ppo.h"

#include <cmath>

#include <ATen/core/grad_mode.h>

#include "pictura/common/error.h"
#include "pictura/training/chunks.h"
#include "pictura/training/precision.h"
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

namespace {

void clear_gradients(const std::vector<NamedTensor>& parameters) {
  for (const NamedTensor& parameter : parameters) parameter.value.mutable_grad().reset();
}

// Of all gradients as one vector.
at::Tensor norm_of(const std::vector<at::Tensor>& gradients) {
  return at::stack(at::_foreach_norm(gradients, 2)).norm();
}

}  // namespace

AdamW::Step AdamW::step(double learning_rate, const at::Tensor& loss) {
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
  const at::Tensor norm = norm_of(gradients);
  const at::Tensor failed = (norm + loss).isfinite().logical_not().to(at::kFloat);
  at::_foreach_mul_(gradients, (config_.max_grad_norm / (norm + 1e-6)).clamp_max(1.0));
  ++steps;
  const std::vector<at::Tensor> counts(values.size(), at::full({}, static_cast<double>(steps), norm.options()));
  at::_fused_adamw_(values, gradients, first, second, {}, counts, learning_rate, config_.adam_beta1, config_.adam_beta2,
                    config_.weight_decay, config_.adam_eps, /*amsgrad=*/false, /*maximize=*/false, /*grad_scale=*/{},
                    failed);
  clear_gradients(parameters_);
  return {norm, failed};
}

namespace {

// 1 - Var(returns - values) / Var(returns): 1 is a perfect critic, 0 one that says a constant.
double explained_variance(const at::Tensor& values, const at::Tensor& returns) {
  const double variance = returns.var().item<double>();
  return variance > 0 ? 1 - (returns - values).var().item<double>() / variance : 0;
}

// The transitions of a rollout, flattened: [steps * slots].
struct Batch {
  at::Tensor actions, old_log_probs, advantages, values, returns, valid;

  explicit Batch(const Rollout& rollout)
      : actions(rollout.actions.flatten().to(at::kLong)),
        old_log_probs(rollout.log_probs.flatten()),
        advantages(rollout.advantages.flatten()),
        values(rollout.values.narrow(0, 0, rollout.num_steps()).flatten()),
        returns(advantages + values),
        valid(rollout.valid.flatten()) {}
};

// What each of some transitions counts in their mean: its share of the valid ones, or undefined where all are valid.
at::Tensor shares_of(const at::Tensor& valid) {
  const at::Tensor counts = valid.to(at::kFloat);
  return counts / counts.mean().clamp_min(1.0 / static_cast<double>(counts.size(0)));
}

at::Tensor mean_of(const at::Tensor& values, const at::Tensor& shares) {
  return shares.defined() ? (values * shares).mean() : values.mean();
}

// Advantages of a minibatch with mean 0 and deviation 1 over its valid transitions.
at::Tensor normalised(const at::Tensor& advantages, const at::Tensor& shares) {
  const at::Tensor centered = advantages - mean_of(advantages, shares);
  if (!shares.defined()) return centered / (advantages.std() + 1e-8);
  const at::Tensor count = shares.gt(0).sum();
  const at::Tensor variance = mean_of(centered.square(), shares) * count / (count - 1).clamp_min(1);
  return centered / (variance.sqrt() + 1e-8);
}

// What the losses of some transitions are made of.
struct Losses {
  at::Tensor policy, value, entropy;  // with gradients
  at::Tensor stats;                   // f64 [6], in the order of LossStats
};

// Of the chosen actions.
at::Tensor log_probs_of(const at::Tensor& all_log_probs, const Batch& batch, const at::Tensor& rows) {
  return all_log_probs.gather(1, batch.actions.index_select(0, rows).unsqueeze(1)).squeeze(1);
}

Losses losses_of(const Policy::Output& output, const Batch& batch, const at::Tensor& rows, const at::Tensor& advantage,
                 const at::Tensor& shares, double clip_coef) {
  const at::Tensor all_log_probs = at::log_softmax(output.logits, 1);
  const at::Tensor log_prob = log_probs_of(all_log_probs, batch, rows);
  const at::Tensor log_ratio = log_prob - batch.old_log_probs.index_select(0, rows);
  const at::Tensor ratio = log_ratio.exp();
  const at::Tensor clipped = ratio.clamp(1 - clip_coef, 1 + clip_coef);
  Losses losses;
  losses.policy = -mean_of(at::minimum(advantage * ratio, advantage * clipped), shares);
  losses.value = 0.5 * mean_of((output.value - batch.returns.index_select(0, rows)).square(), shares);
  losses.entropy = -mean_of((all_log_probs.exp() * all_log_probs).sum(1), shares);
  const at::NoGradGuard no_grad;
  // Schulman's estimator of the KL divergence, (ratio - 1) - log ratio: unbiased and never negative.
  const at::Tensor approx_kl = mean_of(ratio - 1 - log_ratio, shares);
  const at::Tensor clip_fraction = mean_of(((ratio - 1).abs() > clip_coef).to(at::kFloat), shares);
  losses.stats = at::stack({losses.policy, losses.value, losses.entropy, approx_kl, clip_fraction,
                            mean_of(log_ratio.abs(), shares)})
                     .detach()
                     .to(at::kDouble);
  return losses;
}

// The norm of a loss's gradient over all parameters.
at::Tensor gradient_norm(const at::Tensor& loss, const Policy& policy) {
  clear_gradients(policy.parameters());
  loss.backward(/*gradient=*/{}, /*retain_graph=*/true);
  std::vector<at::Tensor> gradients;
  for (const NamedTensor& parameter : policy.parameters()) {
    if (parameter.value.grad().defined()) gradients.push_back(parameter.value.grad());
  }
  clear_gradients(policy.parameters());
  return norm_of(gradients);
}

constexpr int64_t kNumStats = 7;  // of LossStats

LossStats loss_stats(const at::Tensor& row) {
  const double* const values = row.const_data_ptr<double>();
  return {values[0], values[1], values[2], values[3], values[4], values[5], values[6]};
}

bool takes_all(const Config::Train& config) { return config.halted_slots == HaltedSlots::draw; }

// The rows of the transitions that are learned from, i64 [n]: those that the filter keeps, or all, of which those that
// are not valid have no share. Says in the stats what the filter did.
at::Tensor taken_rows(const Batch& batch, const Config::Train& config, int64_t update, LearnerExecutor* executor,
                      AdvantageFilter* filter, UpdateStats* stats) {
  const float max_advantage = batch.advantages.abs().max().item<float>();
  PICTURA_CHECK(std::isfinite(max_advantage), "update {}: an advantage is not finite", update + 1);
  const float threshold = filter->threshold(max_advantage, config.adv_filter_ema, config.adv_filter_threshold);
  stats->adv_threshold = static_cast<double>(threshold);
  const at::Tensor kept_and_unused = at::empty_like(batch.advantages, at::kLong);
  const int64_t num_kept =
      executor->select_kept(span_of<const float>(batch.advantages), span_of<const uint8_t>(batch.valid), threshold,
                            span_of<int64_t>(kept_and_unused));
  if (num_kept == 0) return kept_and_unused.narrow(0, 0, 0);
  const at::Tensor valid = at::nonzero(batch.valid).squeeze(1);
  stats->kept_fraction = static_cast<double>(num_kept) / static_cast<double>(valid.size(0));
  stats->explained_variance =
      explained_variance(batch.values.index_select(0, valid), batch.returns.index_select(0, valid));
  return takes_all(config) ? at::arange(batch.valid.size(0), kept_and_unused.options())
                           : kept_and_unused.narrow(0, 0, num_kept);
}

// The transitions of some rows in the order of an epoch, cut into minibatches of equal size, to one transition.
class Minibatches {
 public:
  Minibatches(const at::Tensor& taken, int64_t most, const UpdateKey& key, LearnerExecutor* executor)
      : taken_(taken),
        shuffled_(at::empty_like(taken)),
        count_((taken.size(0) + most - 1) / most),
        key_(key),
        executor_(executor) {}

  /// Of an epoch.
  int64_t count() const { return count_; }

  void shuffle(int64_t epoch) {
    executor_->permute(Permutation(key_.seed, key_.update, epoch, taken_.size(0)), span_of<const int64_t>(taken_),
                       span_of<int64_t>(shuffled_));
  }

  /// The rows of one, as the last shuffle() left them.
  at::Tensor rows(int64_t m) const {
    const int64_t begin = taken_.size(0) * m / count_, end = taken_.size(0) * (m + 1) / count_;
    return shuffled_.narrow(0, begin, end - begin);
  }

 private:
  const at::Tensor taken_, shuffled_;
  const int64_t count_;
  const UpdateKey key_;
  LearnerExecutor* const executor_;
};

// What each row of a chunk counts in the chunk's means: undefined where each counts as one. `shares` are those of the
// whole minibatch, or undefined. What fills the chunk up counts nothing.
at::Tensor shares_in(const Chunk& chunk, const at::Tensor& shares, const at::TensorOptions& options) {
  if (chunk.count == chunk.size()) return shares.defined() ? chunk.take(shares) : shares;
  const at::Tensor padded =
      shares.defined() ? chunk.take(shares)
                       : at::constant_pad_nd(at::ones({chunk.count}, options), {0, chunk.size() - chunk.count});
  return padded * (static_cast<double>(chunk.size()) / static_cast<double>(chunk.count));
}

// Adds a minibatch's gradients to those of the parameters, `forward_chunk` transitions at a time. Returns its LossStats
// without the norm, f64 [kNumStats]. With `norms`, appends the norms of the first chunk's gradient by each loss alone.
at::Tensor add_gradients(const Policy& policy, const Rollout& rollout, const Batch& batch, const at::Tensor& minibatch,
                         const Config::Train& config, PhaseTimer* timer, std::vector<at::Tensor>* norms) {
  const int64_t size_of_all = minibatch.size(0);
  at::Tensor advantages = batch.advantages.index_select(0, minibatch);
  const at::Tensor shares = takes_all(config) ? shares_of(batch.valid.index_select(0, minibatch)) : at::Tensor();
  if (config.norm_adv && size_of_all > 1) advantages = normalised(advantages, shares);
  const at::Tensor stats = at::zeros({kNumStats}, advantages.options().dtype(at::kDouble));
  for_each_chunk(minibatch, config.forward_chunk, [&](const Chunk& chunk) {
    const double weight = static_cast<double>(chunk.count) / static_cast<double>(size_of_all);
    const Observation observation = rollout.observations.gather(chunk.rows);
    const auto look = [&] {
      const PhaseTimer::Scope timed(timer, Phase::learn);
      return losses_of(policy.forward(observation), batch, chunk.rows, chunk.take(advantages),
                       shares_in(chunk, shares, advantages.options()), config.clip_coef);
    };
    const Losses losses = look();
    if (norms && chunk.begin == 0) {
      const PhaseTimer::Scope timed(timer, Phase::diagnose);
      for (const at::Tensor& loss : {losses.policy, config.vf_coef * losses.value, config.ent_coef * losses.entropy}) {
        norms->push_back(gradient_norm(loss, policy));
      }
    }
    const PhaseTimer::Scope timed(timer, Phase::backward);
    const at::Tensor loss = losses.policy + config.vf_coef * losses.value - config.ent_coef * losses.entropy;
    (loss * weight).backward();
    stats.narrow(0, 0, kNumStats - 1) += weight * losses.stats;
  });
  return stats;
}

// Whether the rollout's log-probabilities differ from the learner's by more than rounding. What is not finite is no
// matter of arithmetic, and fails.
bool must_be_recomputed(const LossStats& first) {
  return std::isfinite(first.abs_log_ratio) &&
         (first.abs_log_ratio >= kMostAbsLogRatio || first.clip_fraction >= kMostClipFraction);
}

// The log-probabilities of all chosen actions [steps * slots], for kept transitions by the learner's forward pass: in
// the minibatches and chunks in which they are learned from next, so that not even the batch's size differs.
at::Tensor recomputed_log_probs(const Policy& policy, const Rollout& rollout, const Batch& batch,
                                const Minibatches& minibatches, int64_t forward_chunk, PhaseTimer* timer) {
  const at::NoGradGuard no_grad;
  at::Tensor log_probs = batch.old_log_probs.clone();
  for (int64_t m = 0; m < minibatches.count(); ++m) {
    for_each_chunk(minibatches.rows(m), forward_chunk, [&](const Chunk& chunk) {
      const Observation observation = rollout.observations.gather(chunk.rows);
      const PhaseTimer::Scope timed(timer, Phase::learn);
      const at::Tensor all = at::log_softmax(policy.forward(observation).logits, 1).narrow(0, 0, chunk.count);
      const at::Tensor rows = chunk.rows.narrow(0, 0, chunk.count);
      log_probs.index_copy_(0, rows, log_probs_of(all, batch, rows));
    });
  }
  return log_probs;
}

// All that a minibatch was made of but its images, as NotFinite names it.
std::vector<NamedTensor> contents_of(const at::Tensor& minibatch, const Batch& batch, const Rollout& rollout) {
  std::vector<NamedTensor> contents{{"rows", minibatch}};
  const auto add = [&](std::string_view name, const at::Tensor& all) {
    contents.push_back({std::string(name), all.index_select(0, minibatch)});
  };
  add("actions", batch.actions);
  add("advantages", batch.advantages);
  add("log_probs", batch.old_log_probs);
  add("returns", batch.returns);
  for (size_t i = 0; i < std::size(kObservationArrays); ++i) {
    const at::Tensor& array = rollout.observations.arrays().*kObservationTensors[i];
    if (array.defined()) add(kObservationArrays[i].name, array.flatten(0, 1));
  }
  return contents;
}

}  // namespace

UpdateStats ppo_update(const Policy& policy, const Rollout& rollout, const Config::Train& config, const UpdateKey& key,
                       LearnerExecutor* executor, AdamW* optimizer, AdvantageFilter* filter, PhaseTimer* timer) {
  UpdateStats stats;
  stats.learning_rate = key.learning_rate;
  Batch batch(rollout);
  const at::Tensor taken = taken_rows(batch, config, key.update, executor, filter, &stats);
  if (taken.size(0) == 0) return stats;
  Minibatches minibatches(taken, config.minibatch_size, key, executor);
  const Autotuner autotuner;

  // Sums over the minibatches of each epoch; the last row is the first minibatch. What is not finite stays in them, so
  // no minibatch takes a step after the first that fails.
  const at::Tensor sums =
      at::zeros({config.update_epochs + 1, kNumStats}, batch.advantages.options().dtype(at::kDouble));
  at::Tensor num_failed = at::zeros({}, batch.advantages.options());
  const auto check = [&] {
    const auto failed = static_cast<int64_t>(num_failed.item<float>());
    if (failed == 0) return;
    const int64_t number = stats.minibatches - failed, epoch = number / minibatches.count(),
                  m = number % minibatches.count();
    minibatches.shuffle(epoch);
    throw NotFinite(fmt::format("update {}, epoch {}, minibatch {}: the loss or its gradient is not finite",
                                key.update + 1, epoch + 1, m + 1),
                    contents_of(minibatches.rows(m), batch, rollout));
  };
  std::vector<at::Tensor> first_norms;
  for (int epoch = 0; epoch < config.update_epochs; ++epoch) {
    minibatches.shuffle(epoch);
    for (int64_t m = 0; m < minibatches.count(); ++m) {
      const bool is_first = stats.minibatches == 0;
      const auto add_its_gradients = [&] {
        return add_gradients(policy, rollout, batch, minibatches.rows(m), config, timer,
                             is_first ? &first_norms : nullptr);
      };
      at::Tensor minibatch_stats = add_its_gradients();
      if (is_first) {
        const LossStats first = loss_stats(minibatch_stats.cpu());
        if (must_be_recomputed(first)) {
          stats.rejected = first;
          batch.old_log_probs = recomputed_log_probs(policy, rollout, batch, minibatches, config.forward_chunk, timer);
          clear_gradients(policy.parameters());
          first_norms.clear();
          minibatch_stats = add_its_gradients();
        }
      }
      const PhaseTimer::Scope timed(timer, Phase::optimize);
      const AdamW::Step step = optimizer->step(key.learning_rate, sums.sum() + minibatch_stats.sum());
      minibatch_stats[kNumStats - 1] = step.norm;
      sums[epoch] += minibatch_stats;
      if (is_first) sums[config.update_epochs] += minibatch_stats;
      num_failed += step.failed;
      ++stats.minibatches;
      if (num_failed.is_cpu()) check();  // a device is not waited for
    }
  }
  check();

  const at::Tensor all = sums.cpu(), epochs = all.narrow(0, 0, config.update_epochs);
  stats.all = loss_stats(epochs.sum(0) / static_cast<double>(stats.minibatches));
  stats.first = loss_stats(all[config.update_epochs]);
  for (int epoch = 0; epoch < config.update_epochs; ++epoch) {
    stats.epochs.push_back(loss_stats(epochs[epoch] / static_cast<double>(minibatches.count())));
  }
  const at::Tensor norms = at::stack(first_norms).cpu();
  stats.policy_grad_norm = norms[0].item<double>();
  stats.value_grad_norm = norms[1].item<double>();
  stats.entropy_grad_norm = norms[2].item<double>();
  return stats;
}

}  // namespace pictura
