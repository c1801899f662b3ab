// Proximal policy optimization (Schulman et al., 2017) with the paper's settings: clipped surrogate, plain value loss,
// entropy bonus, advantages filtered per rollout and normalised per minibatch, AdamW under a cosine schedule. In
// addition to the paper, the policy can imitate a teacher in the first part of training.
#pragma once

#include <optional>

#include "pictura/common/error_types.h"
#include "pictura/training/chunk_runner.h"
#include "pictura/training/gradient_diagnosis.h"
#include "pictura/training/optimizer.h"

namespace pictura {

/// State of the advantage filter (rules/advantage_filter.h) across rollouts.
struct AdvantageFilter {
  double average =
      -1;  // average of each rollout's largest |advantage|, or of a quantile of its |advantages|; negative at first
};

/// Upper bounds of rounding differences between a rollout's log-probabilities and the learner's, before the first step.
/// kMaxAbsLogRatio limits the mean absolute difference, and kMaxClipFraction the share of ratios outside the clip
/// range. Larger differences cause the log-probabilities to be recomputed.
constexpr double kMaxAbsLogRatio = 1e-3, kMaxClipFraction = 1e-3;

/// Statistics of an update.
struct UpdateStats {
  LossStats all;    // means over the update's minibatches
  LossStats first;  // losses of the first minibatch, before the parameters change
  std::optional<LossStats>
      rejected;                   // value of `first` before log-probabilities were recomputed; empty if they were not
  std::vector<LossStats> epochs;  // means over each epoch's minibatches
  GradientNorms gradient_norms;
  double learning_rate = 0;
  double explained_variance = 0;  // share of the returns' variance that values explain, over all valid transitions
  double kept_fraction = 0, adv_threshold = 0;
  int64_t minibatches = 0;
  WeightRms weights;  // after the update
};

/// Objects that an update uses. They must outlive the update.
struct Learner {
  ChunkRunner* runner;  // runner of the policy and of the rollout's observations
  LearnerExecutor* executor;
  Optimizer* optimizer;
  AdvantageFilter* filter;
  PhaseTimer* timer = nullptr;
  Communicator* communicator = single_communicator();
};

/// Inputs of an update other than its rollout and settings.
struct UpdateKey {
  uint64_t seed = 0;  // `seed` and `update` determine the order of transitions
  int64_t update = 0;
  double learning_rate = 0;
  double teacher_weight = 0;
};

/// Error thrown if a loss or a gradient is not finite. Its message names update, epoch and minibatch, counted from 1.
class NotFinite : public Error {
 public:
  NotFinite(const std::string& message, std::vector<NamedTensor> its_minibatch)
      : Error(message), minibatch(std::move(its_minibatch)) {}
  /// Tensors of the minibatch: rows (of the rollout), actions, advantages, log_probs, returns, and the observation's
  /// arrays except images.
  std::vector<NamedTensor> minibatch;
};

/// Returns the PPO losses of a chunk; see LossFunction.
Losses ppo_losses(const Policy::Output& output, const Targets& targets, const Minibatch& chunk,
                  const TrainSection& config);

/// Improves the policy on a rollout, and computes the rollout's advantages. Each rank has consecutive slots of one
/// rollout, with equally many steps. All ranks improve one policy on the whole rollout, and get bit-identical
/// parameters and equal statistics. Throws NotFinite if the loss or gradient of a minibatch is not finite: on the host
/// at that minibatch, on a device at the end of the update. The policy is then as it was before that minibatch.
UpdateStats ppo_update(const Learner& learner, Rollout* rollout, const TrainSection& config, const UpdateKey& key);

}  // namespace pictura
