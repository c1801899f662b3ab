// One PPO update, which can be read from top to bottom like CleanRL's ppo.py. First come the losses, then
// PpoUpdate::run() and its steps in order: advantages, filter, minibatches, gradients, optimizer and statistics.
// Tensors hold the transitions of this rank; the communicator sums over ranks. ChunkRunner handles chunks and CUDA
// graphs. Minibatches handles the order of transitions over all ranks.
#include "pictura/training/ppo.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <ATen/core/grad_mode.h>

#include "pictura/common/error.h"
#include "pictura/policy/precision.h"
#include "pictura/policy/torch_device.h"
#include "pictura/training/rules/advantage_filter.h"

namespace pictura {

namespace {

// Returns the log-probabilities of the actions taken at these rows. all_log_probs: [rows, kNumActions].
at::Tensor log_probs_of(const at::Tensor& all_log_probs, const Targets& targets, const at::Tensor& rows) {
  // All terms of this sum but one are 0. It replaces gather(), whose gradient waits for the host if algorithms are
  // deterministic.
  const at::Tensor actions = targets.actions.index_select(0, rows).unsqueeze(1);
  return all_log_probs.masked_fill(at::arange(all_log_probs.size(1), actions.options()) != actions, 0).sum(1);
}

}  // namespace

at::Tensor scene_scale_of(const at::Tensor& embeddings, const at::Tensor& weights, Communicator* communicator) {
  const at::Tensor numbers = embeddings.to(at::kDouble), weighted = weights.unsqueeze(1) * numbers;
  const at::Tensor sums = at::cat({at::stack({weights.sum(), (weighted * numbers).sum()}), weighted.sum(0)});
  communicator->sum(sums);
  const at::Tensor count = sums[0].clamp_min(1), square = sums[1] / count;
  const at::Tensor variance = square - (sums.slice(0, 2) / count).square().sum();
  // The variance of equal embeddings is a rounding error.
  return variance.reciprocal().masked_fill(variance <= 1e-9 * square, 0).to(at::kFloat);
}

Losses ppo_losses(const Policy::Output& output, const Targets& targets, const Minibatch& chunk,
                  const TrainSection& config) {
  const auto mean = [&chunk](const at::Tensor& values) {
    return chunk.shares.defined() ? (values * chunk.shares).mean() : values.mean();
  };
  const at::Tensor all_log_probs = at::log_softmax(output.logits, 1);
  const at::Tensor log_prob = log_probs_of(all_log_probs, targets, chunk.rows);
  const at::Tensor log_ratio = log_prob - targets.old_log_probs.index_select(0, chunk.rows);
  // Without the policy loss, the policy may change so fast that ratios overflow, which are statistics then.
  const at::Tensor ratio = (config.policy_coef > 0 ? log_ratio : log_ratio.clamp_max(20)).exp();
  const at::Tensor clipped = ratio.clamp(1 - config.clip_coef, 1 + config.clip_coef);
  Losses losses;
  losses.policy = -mean(at::minimum(chunk.advantages * ratio, chunk.advantages * clipped));
  losses.value = mean(0.5 * (output.value - targets.returns.index_select(0, chunk.rows)).square());
  losses.entropy = -mean((all_log_probs.exp() * all_log_probs).sum(1));
  at::Tensor teacher_kl = at::zeros({}, losses.entropy.options()), imitation;
  if (targets.teacher_log_probs.defined()) {
    const at::Tensor teacher = targets.teacher_log_probs.index_select(0, chunk.rows);
    teacher_kl = mean((teacher.exp() * (teacher - all_log_probs)).sum(1));
    imitation = targets.teacher_weight * teacher_kl;
  }
  at::Tensor scene = at::zeros({}, losses.entropy.options());
  if (targets.teacher_scene.defined()) {
    const at::Tensor errors = output.scene.to(at::kFloat) - targets.teacher_scene.index_select(0, chunk.rows);
    scene = chunk.scene_scale * mean(errors.square().sum(1));
  }
  {
    const at::NoGradGuard no_grad;
    losses.stats = stacked({.policy_loss = losses.policy,
                            .value_loss = losses.value,
                            .teacher_kl = teacher_kl,
                            .scene = scene,
                            .entropy = losses.entropy,
                            // Schulman's estimator of the KL divergence: unbiased and never negative.
                            .approx_kl = mean(ratio - 1 - log_ratio),
                            .clip_fraction = mean(((ratio - 1).abs() > config.clip_coef).to(at::kFloat)),
                            .abs_log_ratio = mean(log_ratio.abs())});
  }
  losses.total = config.vf_coef * losses.value;
  if (config.policy_coef > 0) losses.total = config.policy_coef * losses.policy + losses.total;
  losses.total = losses.total - config.ent_coef * losses.entropy;
  if (imitation.defined()) losses.total = losses.total + imitation;
  if (targets.teacher_scene.defined()) losses.total = losses.total + config.teacher_scene_coef * scene;
  return losses;
}

namespace {

// Returns the variance of n numbers from their sum and the sum of their squares.
double variance_of(double n, double sum, double sum_of_squares) {
  return std::max(0.0, (sum_of_squares - sum * sum / n) / std::max(1.0, n - 1));
}

// One update and the state shared by its steps.
class PpoUpdate {
 public:
  PpoUpdate(const Learner& learner, Rollout* rollout, const TrainSection& config, const UpdateKey& key)
      : learner_(learner), rollout_(*rollout), config_(config), key_(key) {}

  UpdateStats run() {
    stats_.learning_rate = key_.learning_rate;
    compute_advantages();
    Minibatches minibatches(select_rows(), rollout_, config_.minibatch_size, learner_.executor, learner_.communicator);
    if (minibatches.global_size() == 0) return stats_;
    const Autotuner autotuner;
    learner_.runner->set_targets(targets_);
    sums_ = at::zeros({config_.update_epochs + 1, kNumLossStats}, advantages_.options().dtype(at::kDouble));
    num_failed_ = at::zeros({}, advantages_.options());
    GradientDiagnosis diagnosis;
    for (int epoch = 0; epoch < config_.update_epochs; ++epoch) {
      minibatches.shuffle(key_.seed, key_.update, epoch);
      for (int64_t m = 0; m < minibatches.count(); ++m) {
        Minibatch minibatch = minibatches[m];
        prepare(&minibatch);
        const bool is_first = stats_.minibatches == 0;
        if (is_first) diagnosis.measure(minibatch, minibatches, loss_, config_, learner_);
        at::Tensor minibatch_stats = add_gradients(minibatch);
        if (is_first && must_recompute_log_probs(minibatch_stats)) {
          recompute_log_probs(minibatches);
          learner_.optimizer->clear_gradients();
          minibatch_stats = add_gradients(minibatch);
        }
        step(minibatch_stats, epoch);
        if (num_failed_.is_cpu()) check_finite(&minibatches);  // on a GPU this would wait
      }
    }
    check_finite(&minibatches);
    store_means();
    stats_.gradient_norms = diagnosis.norms();
    return stats_;
  }

 private:
  // Computes advantages by GAE (rules/gae.h), and flattens the rollout's transitions to [steps * slots].
  void compute_advantages() {
    rollout_.compute_advantages(config_.gamma, config_.gae_lambda, learner_.executor);
    advantages_ = rollout_.advantages.flatten();
    values_ = rollout_.values.narrow(0, 0, rollout_.num_steps()).flatten();
    decisions_ = rollout_.decisions().flatten();
    targets_ = {rollout_.actions.flatten().to(at::kLong), rollout_.log_probs.flatten(), advantages_ + values_};
    if (rollout_.teacher_scene.defined()) targets_.teacher_scene = rollout_.teacher_scene.flatten(0, 1);
    if (key_.teacher_weight <= 0) return;
    targets_.teacher_log_probs = rollout_.teacher_log_probs.flatten(0, 1);
    targets_.teacher_weight = at::full({}, key_.teacher_weight, advantages_.options());
  }

  // Returns the rows to learn from, i64 [n] in ascending order: the rows that the filter keeps, or all rows if
  // takes_all(). In the second case, invalid rows have weight 0.
  at::Tensor select_rows() {
    const bool by_quantile = config_.adv_filter == FilterThreshold::quantile;
    const float newest = by_quantile ? quantile_of_advantages() : largest_advantage();
    PICTURA_CHECK(std::isfinite(newest), "update {}: an advantage is not finite", key_.update + 1);
    double& average = learner_.filter->average;
    average = filter_average(average, newest, config_.adv_filter_ema);
    const float threshold = filter_threshold(average, by_quantile ? 1 : config_.adv_filter_threshold);
    stats_.adv_threshold = static_cast<double>(threshold);
    const at::Tensor kept_and_unused = at::empty_like(advantages_, at::kLong);
    const int64_t num_kept =
        learner_.executor->select_kept(span_of<const float>(advantages_), span_of<const uint8_t>(decisions_), threshold,
                                       span_of<int64_t>(kept_and_unused), current_stream(learner_.executor->device()));
    if (!count_kept(num_kept)) return kept_and_unused.narrow(0, 0, 0);
    return takes_all() ? at::arange(decisions_.size(0), kept_and_unused.options())
                       : kept_and_unused.narrow(0, 0, num_kept);
  }
  bool takes_all() const { return config_.halted_slots == HaltedSlots::draw; }

  // Returns the largest |advantage| of all ranks; not finite if any advantage is not finite. Waits for the device.
  float largest_advantage() const {
    // Some communicators ignore NaN in a maximum.
    const at::Tensor max = advantages_.abs().max().nan_to_num(std::numeric_limits<double>::infinity());
    learner_.communicator->max(max);
    return max.item<float>();
  }

  // Returns the quantile of the valid |advantages| of all ranks; not finite if any advantage is not finite. Waits for
  // the device.
  float quantile_of_advantages() const {
    const at::Tensor counts = at::zeros({kNumFilterBins}, advantages_.options().dtype(at::kLong));
    learner_.executor->count_advantages(span_of<const float>(advantages_), span_of<const uint8_t>(decisions_),
                                        span_of<int64_t>(counts), current_stream(learner_.executor->device()));
    learner_.communicator->sum(counts);
    const at::Tensor host = counts.cpu();
    const auto of_bins = span_of<const int64_t>(host);
    return of_bins[kNotFiniteBin] > 0 ? std::numeric_limits<float>::infinity()
                                      : filter_quantile(of_bins, config_.adv_filter_quantile);
  }

  // Stores the fraction of all ranks' valid transitions with new decisions that the filter kept, and the fraction of
  // their returns' variance that the values explain: 1 for a perfect critic, 0 for a constant. Returns false if no
  // transition was kept. Waits for the device.
  bool count_kept(int64_t num_kept) {
    const at::Tensor valid = at::nonzero(decisions_).squeeze(1),
                     returns = targets_.returns.index_select(0, valid).to(at::kDouble),
                     errors = returns - values_.index_select(0, valid);
    const at::Tensor sums = at::stack({at::full({}, num_kept, returns.options()), at::ones_like(returns).sum(),
                                       returns.sum(), returns.square().sum(), errors.sum(), errors.square().sum()});
    learner_.communicator->sum(sums);
    const at::Tensor host = sums.cpu();
    std::array<double, 6> of_all;
    std::copy_n(host.const_data_ptr<double>(), of_all.size(), of_all.begin());
    const auto [kept, n, sum, squares, error_sum, error_squares] = of_all;
    if (kept == 0) return false;
    stats_.kept_fraction = kept / n;
    const double variance = variance_of(n, sum, squares);
    stats_.explained_variance = variance > 0 ? 1 - variance_of(n, error_sum, error_squares) / variance : 0;
    return true;
  }

  // Sets a minibatch's advantages, normalised over all ranks' transitions, the weights of its rows in means, and the
  // scale of its scene loss.
  void prepare(Minibatch* minibatch) const {
    at::Tensor advantages = advantages_.index_select(0, minibatch->rows);
    const at::Tensor valid = takes_all() ? decisions_.index_select(0, minibatch->rows).to(at::kDouble)
                                         : at::ones_like(advantages, at::kDouble);
    const at::Tensor sums = at::stack({valid.sum(), (valid * advantages).sum(), (valid * advantages.square()).sum()});
    learner_.communicator->sum(sums);
    const at::Tensor count = sums[0].clamp_min(1), mean = sums[1] / count;
    if (config_.norm_adv && minibatch->global_size > 1) {
      const at::Tensor variance = ((sums[2] - sums[1] * mean) / (count - 1).clamp_min(1)).clamp_min(0);
      advantages = (advantages - mean) / (variance.sqrt() + 1e-8);
    }
    minibatch->advantages = advantages;
    if (takes_all()) {
      minibatch->shares = (valid * (static_cast<double>(minibatch->global_size) / count)).to(at::kFloat);
    }
    if (targets_.teacher_scene.defined()) {
      minibatch->scene_scale =
          scene_scale_of(targets_.teacher_scene.index_select(0, minibatch->rows), valid, learner_.communicator);
    }
  }

  // Runs a minibatch forward and backward. This adds this rank's part of the minibatch's gradient to the parameters'
  // gradients. Returns the minibatch's statistics over all ranks, valid until the next call.
  at::Tensor add_gradients(const Minibatch& minibatch) {
    const at::Tensor minibatch_stats = learner_.runner->add_gradients(minibatch, config_.forward_chunk, loss_);
    learner_.communicator->sum(minibatch_stats);
    return minibatch_stats;
  }

  // Returns whether the rollout's log-probabilities differ from the learner's by more than rounding in the first
  // minibatch. Ignores values that are not finite, because check_finite() handles them. Waits for the device.
  bool must_recompute_log_probs(const at::Tensor& minibatch_stats) {
    const LossStats first = numbers_of(minibatch_stats.cpu());
    const bool differs = first.abs_log_ratio >= kMaxAbsLogRatio || first.clip_fraction >= kMaxClipFraction;
    if (!std::isfinite(first.abs_log_ratio) || !differs) return false;
    stats_.rejected = first;
    return true;
  }

  // Replaces the log-probabilities of kept transitions by those of the learner's forward pass. This pass uses the same
  // minibatches and chunks as the update that follows, so that batch sizes agree too.
  void recompute_log_probs(const Minibatches& minibatches) {
    const at::NoGradGuard no_grad;
    const at::Tensor log_probs = targets_.old_log_probs.clone();
    for (int64_t m = 0; m < minibatches.count(); ++m) {
      for_each_chunk(minibatches[m].rows, {config_.forward_chunk}, [&](const Chunk& chunk) {
        const at::Tensor logits = learner_.runner->forward_no_grad(chunk.rows).logits;
        const at::Tensor rows = chunk.rows.narrow(0, 0, chunk.count);
        const at::Tensor all_log_probs = at::log_softmax(logits, 1).narrow(0, 0, chunk.count);
        log_probs.index_copy_(0, rows, log_probs_of(all_log_probs, targets_, rows));
      });
    }
    targets_.old_log_probs = log_probs;
    learner_.runner->set_targets(targets_);
  }

  // Steps along the clipped gradient of all ranks. The gradient is summed over ranks before it is clipped, so every
  // rank takes a bit-identical step. Values that are not finite stay in sums_, so no minibatch takes a step after the
  // first failure.
  void step(const at::Tensor& minibatch_stats, int epoch) {
    const at::NoGradGuard no_grad;
    const PhaseTimer::Scope timed(learner_.timer, Phase::optimize);
    const at::Tensor loss = sums_.sum() + minibatch_stats.sum();
    Optimizer& optimizer = *learner_.optimizer;
    learner_.communicator->sum(optimizer.gradients());
    const at::Tensor norm = optimizer.gradient_norm();
    const at::Tensor failed = (norm + loss).isfinite().logical_not().to(at::kFloat);
    optimizer.gradients().mul_((config_.max_grad_norm / (norm + 1e-6)).clamp_max(1.0));
    optimizer.step(key_.learning_rate, failed);

    elements_of(minibatch_stats).grad_norm.copy_(norm);
    sums_[epoch] += minibatch_stats;
    if (stats_.minibatches == 0) sums_[config_.update_epochs] += minibatch_stats;
    num_failed_ += failed;
    ++stats_.minibatches;
  }

  // Throws NotFinite with the first minibatch that failed, if any. Waits for the device.
  void check_finite(Minibatches* minibatches) const {
    const auto failed = static_cast<int64_t>(num_failed_.item<float>());
    if (failed == 0) return;
    const int64_t number = stats_.minibatches - failed, epoch = number / minibatches->count(),
                  m = number % minibatches->count();
    minibatches->shuffle(key_.seed, key_.update, epoch);
    const at::Tensor rows = (*minibatches)[m].rows;
    std::vector<NamedTensor> contents{{"rows", rows}};
    const auto add = [&](std::string_view name, const at::Tensor& all) {
      contents.push_back({std::string(name), all.index_select(0, rows)});
    };
    add("actions", targets_.actions);
    add("advantages", advantages_);
    add("log_probs", targets_.old_log_probs);
    add("returns", targets_.returns);
    for (size_t i = 0; i < std::size(kObservationArrays); ++i) {
      const at::Tensor& array = rollout_.observations.arrays().*kObservationTensors[i];
      if (array.defined()) add(kObservationArrays[i].name, array.flatten(0, 1));
    }
    throw NotFinite(fmt::format("update {}, epoch {}, minibatch {}: the loss or its gradient is not finite",
                                key_.update + 1, epoch + 1, m + 1),
                    contents);
  }

  // Stores the statistics: means over the minibatches of the whole update and of each epoch, and those of the first
  // minibatch.
  void store_means() {
    const at::Tensor sums = sums_.cpu(), epochs = sums.narrow(0, 0, config_.update_epochs);
    const auto num_minibatches = static_cast<double>(stats_.minibatches);
    stats_.all = numbers_of(epochs.sum(0) / num_minibatches);
    stats_.first = numbers_of(sums[config_.update_epochs]);
    for (int epoch = 0; epoch < config_.update_epochs; ++epoch) {
      stats_.epochs.push_back(numbers_of(epochs[epoch] / (num_minibatches / config_.update_epochs)));
    }
  }

  const Learner& learner_;
  Rollout& rollout_;
  const TrainSection& config_;
  const UpdateKey& key_;
  const LossFunction loss_ = [this](const Policy::Output& output, const Targets& targets, const Minibatch& chunk) {
    return ppo_losses(output, targets, chunk, config_);
  };
  at::Tensor advantages_, values_, decisions_;  // [steps * slots]
  Targets targets_;
  at::Tensor sums_;        // f64 [epochs + 1, kNumLossStats], sums over minibatches; the last row: the first minibatch
  at::Tensor num_failed_;  // f32 scalar, number of minibatches that took no step
  UpdateStats stats_;
};

}  // namespace

UpdateStats ppo_update(const Learner& learner, Rollout* rollout, const TrainSection& config, const UpdateKey& key) {
  return PpoUpdate(learner, rollout, config, key).run();
}

}  // namespace pictura
