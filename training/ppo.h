// Proximal policy optimization (Schulman et al., 2017) with the paper's settings. In addition to the paper, the policy
// can imitate a teacher early in training.
#pragma once

#include <optional>

#include "pictura/common/error_types.h"
#include "pictura/training/chunk_runner.h"
#include "pictura/training/gradient_diagnosis.h"
#include "pictura/training/optimizer.h"

namespace pictura {

/// State of the advantage filter (rules/advantage_filter.h).
struct AdvantageFilter {
  double average = -1;  // average over rollouts; negative: none yet
};

/// Limits for rounding differences between the rollout's and the learner's log-probabilities in an update's first
/// minibatch: mean absolute difference, and share of ratios outside the clip range. Beyond them, log-probabilities are
/// recomputed.
constexpr double kMaxAbsLogRatio = 1e-3, kMaxClipFraction = 1e-3;

/// Statistics of an update.
struct UpdateStats {
  LossStats all;                      // means over minibatches
  LossStats first;                    // the first minibatch, before parameters change
  std::optional<LossStats> rejected;  // `first` before log-probabilities were recomputed
  std::vector<LossStats> epochs;      // means per epoch
  GradientNorms gradient_norms;
  double learning_rate = 0;
  double explained_variance = 0;  // share of the returns' variance that values explain
  double kept_fraction = 0, adv_threshold = 0;
  int64_t minibatches = 0;
  WeightRms weights;  // after the update
};

/// Objects that an update uses.
struct Learner {
  ChunkRunner* runner;
  LearnerExecutor* executor;
  Optimizer* optimizer;
  AdvantageFilter* filter;
  PhaseTimer* timer = nullptr;
  Communicator* communicator = single_communicator();
};

/// Inputs of an update other than rollout and settings.
struct UpdateKey {
  uint64_t seed = 0;  // `seed` and `update` determine the order of transitions
  int64_t update = 0;
  double learning_rate = 0;
  double teacher_weight = 0;
};

/// Error of a loss or gradient that is not finite. The message counts update, epoch and minibatch from 1.
class NotFinite : public Error {
 public:
  NotFinite(const std::string& message, std::vector<NamedTensor> its_minibatch)
      : Error(message), minibatch(std::move(its_minibatch)) {}
  /// Rows, actions, advantages, log_probs, returns, and observations without images.
  std::vector<NamedTensor> minibatch;
};

/// Returns 1 / variance of scene embeddings [n, width] with weights f64 [n], summed over dimensions, as an f32 scalar;
/// 0 if all embeddings are equal. Mean squared errors times this scale are 1 - R^2. Collective: every rank passes its
/// rows of a minibatch, and gets the same scale.
at::Tensor scene_scale_of(const at::Tensor& embeddings, const at::Tensor& weights, Communicator* communicator);

Losses ppo_losses(const Policy::Output& output, const Targets& targets, const Minibatch& chunk,
                  const TrainSection& config);

/// Computes a rollout's advantages and improves the policy on it. Each rank has consecutive slots of one rollout, with
/// equally many steps. All ranks get bit-identical parameters and equal statistics. Throws NotFinite if a minibatch's
/// loss or gradient is not finite: on the host at that minibatch, on a device at the end of the update. The policy is
/// then as before that minibatch.
UpdateStats ppo_update(const Learner& learner, Rollout* rollout, const TrainSection& config, const UpdateKey& key);

}  // namespace pictura
