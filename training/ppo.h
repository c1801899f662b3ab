// Proximal policy optimization (Schulman et al., 2017) with the paper's settings: clipped surrogate, plain value loss,
// entropy bonus, advantages filtered per rollout and normalised per minibatch, AdamW under a cosine schedule. Beyond
// the paper: a teacher to imitate for a while.
#pragma once

#include <optional>

#include "pictura/common/error.h"
#include "pictura/training/chunk_runner.h"
#include "pictura/training/optimizer.h"
#include "pictura/training/rollout.h"

namespace pictura {

/// The memory of the advantage filter (rules/advantage_filter.h) from rollout to rollout.
class AdvantageFilter {
 public:
  /// Takes in the newest rollout's largest |advantage|, or its quantile. Returns the least |advantage| that is kept:
  /// that fraction of the average.
  float threshold(float newest, double ema, double fraction);
  double average = -1;  // of the rollouts' maxima or quantiles; negative before the first
};

/// Means over minibatches; docs/training.md defines them.
struct LossStats {
  double policy_loss = 0, value_loss = 0, entropy = 0, approx_kl = 0, clip_fraction = 0, abs_log_ratio = 0;
  double teacher_kl = 0;  // from the teacher's actions, unweighted
  double grad_norm = 0;
};

/// What the log-probabilities that a rollout kept must be to the learner's before the first step, when the two differ
/// by rounding alone: the mean of their absolute differences, and the share of ratios beyond the clip range, are below
/// this.
constexpr double kMostAbsLogRatio = 1e-3, kMostClipFraction = 1e-3;

struct UpdateStats {
  LossStats all;    // of the whole update
  LossStats first;  // of its first minibatch, before the parameters change
  /// The same by the rollout's log-probabilities, where these were not the learner's and were computed again.
  std::optional<LossStats> rejected;
  std::vector<LossStats> epochs;  // of each
  /// Of the gradient of the first minibatch's first chunk by each loss alone, with its coefficient. On the host that
  /// chunk has a 64th of the transitions that the update passes over.
  double policy_grad_norm = 0, value_grad_norm = 0, entropy_grad_norm = 0;
  double learning_rate = 0;
  double explained_variance = 0;  // over all valid transitions
  double kept_fraction = 0, adv_threshold = 0;
  int64_t minibatches = 0;
  WeightRms weights;  // after the update
};

/// What names an update: its transitions' order, its rate, and what the teacher weighs.
struct UpdateKey {
  uint64_t seed = 0;
  int64_t update = 0;
  double learning_rate = 0;
  double teacher_weight = 0;
};

/// A loss or a gradient was not finite; names update, epoch and minibatch, counted from 1.
class NotFinite : public Error {
 public:
  NotFinite(const std::string& message, std::vector<NamedTensor> its_minibatch)
      : Error(message), minibatch(std::move(its_minibatch)) {}
  /// rows (of the rollout), actions, advantages, log_probs, returns, and the observation's arrays but images.
  std::vector<NamedTensor> minibatch;
};

/// Improves the policy on a rollout with advantages. Ranks have consecutive slots each of one rollout, of equally many
/// steps; all improve one policy on all of it, and get the same parameters to the bit and the same stats. Throws
/// NotFinite, with the policy as it was before that minibatch: in it on the host, at the end on a device. `runner` is
/// of the policy and of the rollout's observations.
UpdateStats ppo_update(ChunkRunner* runner, const Rollout& rollout, const TrainSection& config, const UpdateKey& key,
                       LearnerExecutor* executor, Optimizer* optimizer_inout, AdvantageFilter* filter_inout,
                       PhaseTimer* timer = nullptr, Communicator* communicator = alone());

}  // namespace pictura
