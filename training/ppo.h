// Proximal policy optimization (Schulman et al., 2017) with the paper's settings: clipped surrogate, plain value loss,
// entropy bonus, advantages filtered per rollout and normalised per minibatch, AdamW under a cosine schedule. Beyond
// the paper: a teacher to imitate for a while.
#pragma once

#include <optional>

#include "pictura/common/error_types.h"
#include "pictura/training/chunk_runner.h"
#include "pictura/training/gradient_diagnosis.h"
#include "pictura/training/optimizer.h"

namespace pictura {

/// Memory of the advantage filter (rules/advantage_filter.h) from rollout to rollout.
struct AdvantageFilter {
  double average = -1;  // of the rollouts' maxima or quantiles; negative before the first
};

/// Bounds of the difference between a rollout's log-probabilities and the learner's before the first step, when they
/// differ by rounding alone: of the mean of its absolute values, and of the share of ratios beyond the clip range.
constexpr double kMaxAbsLogRatio = 1e-3, kMaxClipFraction = 1e-3;

/// Statistics of an update.
struct UpdateStats {
  LossStats all;                      // means over its minibatches
  LossStats first;                    // of the first minibatch, before the parameters change
  std::optional<LossStats> rejected;  // `first` by the rollout's log-probabilities, where these were computed again
  std::vector<LossStats> epochs;      // means over each epoch's minibatches
  GradientNorms gradient_norms;
  double learning_rate = 0;
  double explained_variance = 0;  // over all valid transitions
  double kept_fraction = 0, adv_threshold = 0;
  int64_t minibatches = 0;
  WeightRms weights;  // after the update
};

/// Objects that an update works with, which must outlive it.
struct Learner {
  ChunkRunner* runner;  // of the policy and of the rollout's observations
  LearnerExecutor* executor;
  Optimizer* optimizer;
  AdvantageFilter* filter;
  PhaseTimer* timer = nullptr;
  Communicator* communicator = alone();
};

/// Key of an update: what it depends on besides its rollout and its settings.
struct UpdateKey {
  uint64_t seed = 0;  // with `update`, of the transitions' order
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

/// Losses of PPO of a chunk; see LossFunction.
Losses ppo_losses(const Policy::Output& output, const Targets& targets, const Minibatch& chunk,
                  const TrainSection& config);

/// Improves the policy on a rollout, whose advantages it computes. Ranks have consecutive slots each of one rollout, of
/// equally many steps; all improve one policy on all of it, and get the same parameters to the bit and the same
/// statistics. Throws NotFinite, with the policy as it was before that minibatch: in it on the host, at the end on a
/// device.
UpdateStats ppo_update(const Learner& learner, Rollout* rollout, const TrainSection& config, const UpdateKey& key);

}  // namespace pictura
