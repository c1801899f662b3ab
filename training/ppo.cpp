#include "pictura/training/ppo.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <ATen/core/grad_mode.h>

#include "pictura/common/error.h"
#include "pictura/policy/chunks.h"
#include "pictura/policy/precision.h"
#include "pictura/policy/torch_device.h"
#include "pictura/training/rules/advantage_filter.h"

namespace pictura {

float AdvantageFilter::threshold(float newest, double ema, double fraction) {
  average = filter_average(average, newest, ema);
  return filter_threshold(average, fraction);
}

namespace {

// The variance of n numbers, from their sum and that of their squares.
double variance_of(double n, double sum, double sum_of_squares) {
  return std::max(0.0, (sum_of_squares - sum * sum / n) / std::max(1.0, n - 1));
}

// The transitions of a rollout, flattened: [steps * slots].
struct Batch {
  at::Tensor advantages, values, valid;
  Targets targets;

  Batch(const Rollout& rollout, double teacher_weight)
      : advantages(rollout.advantages.flatten()),
        values(rollout.values.narrow(0, 0, rollout.num_steps()).flatten()),
        valid(rollout.decisions().flatten()),
        targets{rollout.actions.flatten().to(at::kLong), rollout.log_probs.flatten(), advantages + values} {
    if (teacher_weight <= 0) return;
    targets.teacher_log_probs = rollout.teacher_log_probs.flatten(0, 1);
    targets.teacher_weight = at::full({}, teacher_weight, advantages.options());
  }
};

// A loss's gradient over all parameters, as one vector. Before and after there is none.
at::Tensor gradient_of(const at::Tensor& loss, Optimizer* optimizer) {
  loss.backward(/*gradient=*/{}, /*retain_graph=*/true);
  const at::Tensor gradient = optimizer->gradients().clone();
  optimizer->clear_gradients();
  return gradient;
}

constexpr int64_t kNumStats = ChunkRunner::kNumStats;

LossStats loss_stats(const at::Tensor& row) {
  const double* const values = row.const_data_ptr<double>();
  return {values[0], values[1], values[2], values[3], values[4], values[5], values[6], values[7]};
}

bool takes_all(const TrainSection& config) { return config.halted_slots == HaltedSlots::draw; }

// The largest |advantage| of all ranks; not finite where one of them is not. Waits for the device.
float largest_advantage(const Batch& batch, Communicator* communicator) {
  // Not every communicator's maximum knows NaN.
  const at::Tensor max = batch.advantages.abs().max().nan_to_num(std::numeric_limits<double>::infinity());
  communicator->max(max);
  return max.item<float>();
}

// The quantile of the valid |advantages| of all ranks; not finite where one of them is not. Waits for the device.
float quantile_of_advantages(const Batch& batch, double share, LearnerExecutor* executor, Communicator* communicator) {
  const at::Tensor counts = at::zeros({kNumFilterBins}, batch.advantages.options().dtype(at::kLong));
  executor->count_advantages(span_of<const float>(batch.advantages), span_of<const uint8_t>(batch.valid),
                             span_of<int64_t>(counts), current_stream(executor->device()));
  communicator->sum(counts);
  const at::Tensor host = counts.cpu();
  const auto of_bins = span_of<const int64_t>(host);
  return of_bins[kNotFiniteBin] > 0 ? std::numeric_limits<float>::infinity() : filter_quantile(of_bins, share);
}

// The rows of this rank's transitions that are learned from, i64 [n]: those that the filter keeps, or all, of which
// those that are not valid have no share. Says in the stats what the filter did on all ranks.
at::Tensor taken_rows(const Batch& batch, const TrainSection& config, int64_t update, LearnerExecutor* executor,
                      AdvantageFilter* filter, Communicator* communicator, UpdateStats* stats) {
  const bool by_quantile = config.adv_filter == FilterThreshold::quantile;
  const float newest = by_quantile ? quantile_of_advantages(batch, config.adv_filter_quantile, executor, communicator)
                                   : largest_advantage(batch, communicator);
  PICTURA_CHECK(std::isfinite(newest), "update {}: an advantage is not finite", update + 1);
  const float threshold =
      filter->threshold(newest, config.adv_filter_ema, by_quantile ? 1 : config.adv_filter_threshold);
  stats->adv_threshold = static_cast<double>(threshold);
  const at::Tensor kept_and_unused = at::empty_like(batch.advantages, at::kLong);
  const int64_t num_kept =
      executor->select_kept(span_of<const float>(batch.advantages), span_of<const uint8_t>(batch.valid), threshold,
                            span_of<int64_t>(kept_and_unused), current_stream(executor->device()));
  const at::Tensor valid = at::nonzero(batch.valid).squeeze(1),
                   returns = batch.targets.returns.index_select(0, valid).to(at::kDouble),
                   errors = returns - batch.values.index_select(0, valid);
  const at::Tensor sums = at::stack({at::full({}, num_kept, returns.options()), at::ones_like(returns).sum(),
                                     returns.sum(), returns.square().sum(), errors.sum(), errors.square().sum()});
  communicator->sum(sums);
  const at::Tensor host = sums.cpu();
  const double* const of_all = host.const_data_ptr<double>();
  const double kept = of_all[0], n = of_all[1];
  if (kept == 0) return kept_and_unused.narrow(0, 0, 0);
  stats->kept_fraction = kept / n;
  // 1 is a perfect critic, 0 one that says a constant.
  const double variance = variance_of(n, of_all[2], of_all[3]);
  stats->explained_variance = variance > 0 ? 1 - variance_of(n, of_all[4], of_all[5]) / variance : 0;
  return takes_all(config) ? at::arange(batch.valid.size(0), kept_and_unused.options())
                           : kept_and_unused.narrow(0, 0, num_kept);
}

// The transitions of some rows in the order of an epoch, cut into minibatches of equal size, to one transition. Rows,
// order and minibatches are those of all ranks together, as one rank alone would have them; of each minibatch a rank
// takes those that are its own.
class Minibatches {
 public:
  /// taken: this rank's rows, ascending.
  Minibatches(const at::Tensor& taken, const Rollout& rollout, int64_t most, const UpdateKey& key,
              LearnerExecutor* executor, Communicator* communicator)
      : key_(key), executor_(executor) {
    // Over all ranks they are numbered by step, then by slot, of which each rank has consecutive ones.
    const int64_t num_steps = rollout.num_steps(), num_slots = rollout.num_slots();
    const at::Tensor begins = at::searchsorted(taken, at::arange(num_steps + 1, taken.options()) * num_slots);
    const at::Tensor counts = at::zeros({num_steps, communicator->size()}, taken.options());
    counts.select(1, communicator->rank()).copy_(begins.diff());
    communicator->sum(counts);
    const at::Tensor first_numbers =
        (counts.flatten().cumsum(0).view_as(counts) - counts).select(1, communicator->rank());
    const at::Tensor step = taken.div(num_slots, "floor");
    const at::Tensor numbers = (first_numbers - begins.narrow(0, 0, num_steps)).index_select(0, step) +
                               at::arange(taken.size(0), taken.options());
    size_ = counts.sum().item<int64_t>();
    count_ = (size_ + most - 1) / most;
    own_ = at::full({size_}, kOfAnotherRank, taken.options()).index_copy_(0, numbers, taken);
  }

  /// Of all ranks' transitions.
  int64_t size() const { return size_; }
  /// Of an epoch.
  int64_t count() const { return count_; }

  void shuffle(int64_t epoch) {
    const at::Tensor shuffled = at::empty_like(own_);
    executor_->permute(Permutation(key_.seed, key_.update, epoch, size_), span_of<const int64_t>(own_),
                       span_of<int64_t>(shuffled), current_stream(executor_->device()));
    const at::Tensor places = at::nonzero(shuffled != kOfAnotherRank).squeeze(1);
    rows_ = shuffled.index_select(0, places);
    const at::Tensor begins = (at::arange(count_ + 1, places.options()) * size_).div(count_, "floor");
    begins_ = at::searchsorted(places, begins).cpu();
    places_ = places;
  }

  /// How many of the first `count` transitions of the epoch are this rank's: as many of its rows, from the first.
  int64_t own_of_first(int64_t count) const {
    return at::searchsorted(places_, at::full({}, count, places_.options())).item<int64_t>();
  }

  /// This rank's rows of one, as the last shuffle() left them.
  at::Tensor rows(int64_t m) const {
    const int64_t* const begins = begins_.const_data_ptr<int64_t>();
    return rows_.narrow(0, begins[m], begins[m + 1] - begins[m]);
  }
  /// Of one, over all ranks.
  int64_t size(int64_t m) const { return size_ * (m + 1) / count_ - size_ * m / count_; }

 private:
  static constexpr int64_t kOfAnotherRank = -1;

  const UpdateKey key_;
  LearnerExecutor* const executor_;
  int64_t size_ = 0, count_ = 0;
  at::Tensor own_;            // [size_] the row of each of all ranks' transitions, as they are numbered
  at::Tensor rows_, begins_;  // in the order of the epoch; [count_ + 1] where each minibatch begins in it
  at::Tensor places_;         // of rows_ in the order of all ranks' transitions
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

// The first of an update's transitions, those of all ranks that are this one's, by whose gradients the single losses
// are compared: so few that a way there and three back are at most 3 % of an update's work.
at::Tensor diagnosed_rows(const Minibatches& minibatches, const TrainSection& config) {
  constexpr int64_t kPassesPerDiagnosed = 100, kMostDiagnosed = 1024;
  const int64_t of_all = minibatches.size() * config.update_epochs / kPassesPerDiagnosed,
                most = std::min({kMostDiagnosed, config.forward_chunk, minibatches.size(0)});
  return minibatches.rows(0).narrow(0, 0, minibatches.own_of_first(std::clamp<int64_t>(of_all, 1, most)));
}

// A minibatch's advantages as they are learned from, and what each of its rows counts (see losses_of).
struct Weighted {
  at::Tensor advantages, shares;
};

// Of this rank's rows of a minibatch, which has `size_of_all` transitions over all ranks.
Weighted weighted(const Batch& batch, const at::Tensor& minibatch, int64_t size_of_all, const TrainSection& config,
                  Communicator* communicator) {
  at::Tensor advantages = batch.advantages.index_select(0, minibatch), shares;
  const at::Tensor valid = takes_all(config) ? batch.valid.index_select(0, minibatch).to(at::kDouble)
                                             : at::ones_like(advantages, at::kDouble);
  const at::Tensor sums = at::stack({valid.sum(), (valid * advantages).sum(), (valid * advantages.square()).sum()});
  communicator->sum(sums);
  const at::Tensor count = sums[0].clamp_min(1), mean = sums[1] / count;
  if (config.norm_adv && size_of_all > 1) {
    const at::Tensor variance = ((sums[2] - sums[1] * mean) / (count - 1).clamp_min(1)).clamp_min(0);
    advantages = (advantages - mean) / (variance.sqrt() + 1e-8);
  }
  if (takes_all(config)) shares = (valid * (static_cast<double>(size_of_all) / count)).to(at::kFloat);
  return {advantages, shares};
}

// The norms of the gradient of some rows, the first ones of a minibatch that is `of_minibatch`, by each loss alone, of
// all ranks: policy, value and entropy, f64 [3].
at::Tensor norms_by_loss(ChunkRunner* runner, const at::Tensor& rows, const Weighted& of_minibatch,
                         const TrainSection& config, Optimizer* optimizer, PhaseTimer* timer,
                         Communicator* communicator) {
  at::Tensor gradients = at::zeros({3, optimizer->gradients().numel()}, optimizer->gradients().options());
  for_each_chunk(rows, {config.forward_chunk}, [&](const Chunk& chunk) {
    const Losses losses =
        runner->losses(chunk.rows, chunk.take(of_minibatch.advantages),
                       shares_in(chunk, of_minibatch.shares, of_minibatch.advantages.options()), config);
    const PhaseTimer::Scope timed(timer, Phase::diagnose);
    gradients = at::stack({gradient_of(losses.policy, optimizer), gradient_of(config.vf_coef * losses.value, optimizer),
                           gradient_of(config.ent_coef * losses.entropy, optimizer)});
  });
  const PhaseTimer::Scope timed(timer, Phase::diagnose);
  const at::Tensor sums = at::constant_pad_nd(gradients, {0, 1}, 1) * rows.size(0);
  communicator->sum(sums);
  return (sums.slice(1, 0, -1).norm(2, {1}) / sums.select(1, -1)).to(at::kDouble);
}

// Adds this rank's part of a minibatch's gradients, which has `size_of_all` transitions over all ranks, to those of the
// parameters, `forward_chunk` transitions at a time. Returns the minibatch's LossStats without the norm, f64
// [kNumStats], until the next minibatch.
at::Tensor add_gradients(ChunkRunner* runner, const at::Tensor& minibatch, const Weighted& its, int64_t size_of_all,
                         const TrainSection& config, Communicator* communicator) {
  runner->begin_minibatch();
  for_each_chunk(minibatch, {config.forward_chunk}, [&](const Chunk& chunk) {
    const double weight = static_cast<double>(chunk.count) / static_cast<double>(size_of_all);
    runner->learn(chunk.rows, chunk.take(its.advantages), shares_in(chunk, its.shares, its.advantages.options()),
                  weight, config);
  });
  communicator->sum(runner->stats());
  return runner->stats();
}

// Whether the rollout's log-probabilities differ from the learner's by more than rounding. What is not finite is no
// matter of arithmetic, and fails.
bool must_be_recomputed(const LossStats& first) {
  return std::isfinite(first.abs_log_ratio) &&
         (first.abs_log_ratio >= kMostAbsLogRatio || first.clip_fraction >= kMostClipFraction);
}

// The log-probabilities of all chosen actions [steps * slots], for kept transitions by the learner's forward pass: in
// the minibatches and chunks in which they are learned from next, so that not even the batch's size differs.
at::Tensor recomputed_log_probs(ChunkRunner* runner, const Targets& targets, const Minibatches& minibatches,
                                int64_t forward_chunk) {
  const at::NoGradGuard no_grad;
  at::Tensor log_probs = targets.old_log_probs.clone();
  for (int64_t m = 0; m < minibatches.count(); ++m) {
    for_each_chunk(minibatches.rows(m), {forward_chunk}, [&](const Chunk& chunk) {
      const at::Tensor all = at::log_softmax(runner->look(chunk.rows).logits, 1).narrow(0, 0, chunk.count);
      const at::Tensor rows = chunk.rows.narrow(0, 0, chunk.count);
      log_probs.index_copy_(0, rows, log_probs_of(all, targets, rows));
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
  add("actions", batch.targets.actions);
  add("advantages", batch.advantages);
  add("log_probs", batch.targets.old_log_probs);
  add("returns", batch.targets.returns);
  for (size_t i = 0; i < std::size(kObservationArrays); ++i) {
    const at::Tensor& array = rollout.observations.arrays().*kObservationTensors[i];
    if (array.defined()) add(kObservationArrays[i].name, array.flatten(0, 1));
  }
  return contents;
}

// From sums over the minibatches of each epoch, f64 [epochs + 1, kNumStats], whose last row is the first minibatch, and
// that one's gradient norms of policy, value and entropy.
void store_means(const at::Tensor& sums, const at::Tensor& first_norms, UpdateStats* stats) {
  const int64_t num_epochs = sums.size(0) - 1;
  const at::Tensor epochs = sums.narrow(0, 0, num_epochs);
  stats->all = loss_stats(epochs.sum(0) / static_cast<double>(stats->minibatches));
  stats->first = loss_stats(sums[num_epochs]);
  const double num_per_epoch = static_cast<double>(stats->minibatches) / static_cast<double>(num_epochs);
  for (int64_t epoch = 0; epoch < num_epochs; ++epoch) {
    stats->epochs.push_back(loss_stats(epochs[epoch] / num_per_epoch));
  }
  stats->policy_grad_norm = first_norms[0].item<double>();
  stats->value_grad_norm = first_norms[1].item<double>();
  stats->entropy_grad_norm = first_norms[2].item<double>();
}

}  // namespace

UpdateStats ppo_update(ChunkRunner* runner, const Rollout& rollout, const TrainSection& config, const UpdateKey& key,
                       LearnerExecutor* executor, Optimizer* optimizer, AdvantageFilter* filter, PhaseTimer* timer,
                       Communicator* communicator) {
  UpdateStats stats;
  stats.learning_rate = key.learning_rate;
  Batch batch(rollout, key.teacher_weight);
  const at::Tensor taken = taken_rows(batch, config, key.update, executor, filter, communicator, &stats);
  Minibatches minibatches(taken, rollout, config.minibatch_size, key, executor, communicator);
  if (minibatches.size() == 0) return stats;
  const Autotuner autotuner;
  runner->set_targets(batch.targets);

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
  at::Tensor first_norms;
  for (int epoch = 0; epoch < config.update_epochs; ++epoch) {
    minibatches.shuffle(epoch);
    for (int64_t m = 0; m < minibatches.count(); ++m) {
      const bool is_first = stats.minibatches == 0;
      const at::Tensor rows = minibatches.rows(m);
      const int64_t size_of_all = minibatches.size(m);
      const Weighted its = weighted(batch, rows, size_of_all, config, communicator);
      if (is_first) {
        first_norms =
            norms_by_loss(runner, diagnosed_rows(minibatches, config), its, config, optimizer, timer, communicator);
      }
      at::Tensor minibatch_stats = add_gradients(runner, rows, its, size_of_all, config, communicator);
      if (is_first) {
        const LossStats first = loss_stats(minibatch_stats.cpu());
        if (must_be_recomputed(first)) {
          stats.rejected = first;
          batch.targets.old_log_probs = recomputed_log_probs(runner, batch.targets, minibatches, config.forward_chunk);
          runner->set_targets(batch.targets);
          optimizer->clear_gradients();
          minibatch_stats = add_gradients(runner, rows, its, size_of_all, config, communicator);
        }
      }
      const PhaseTimer::Scope timed(timer, Phase::optimize);
      const Optimizer::Step step = optimizer->step(key.learning_rate, sums.sum() + minibatch_stats.sum(), communicator);
      minibatch_stats[kNumStats - 1] = step.norm;
      sums[epoch] += minibatch_stats;
      if (is_first) sums[config.update_epochs] += minibatch_stats;
      num_failed += step.failed;
      ++stats.minibatches;
      if (num_failed.is_cpu()) check();  // a device is not waited for
    }
  }
  check();
  store_means(sums.cpu(), first_norms.cpu(), &stats);
  return stats;
}

}  // namespace pictura
