// Minibatches of an update's transitions.
#pragma once

#include "pictura/policy/chunks.h"
#include "pictura/training/ranks/communicator.h"
#include "pictura/training/rollout.h"

namespace pictura {

/// This rank's part of a minibatch or chunk.
struct Minibatch {
  at::Tensor rows;          // i64 [n], rows of the rollout
  int64_t global_size = 0;  // transitions over all ranks
  at::Tensor advantages;    // [n], normalised if train.norm_adv is set
  at::Tensor shares;        // [n], weights in means; undefined: all 1
  at::Tensor scene_scale;   // scalar, see scene_scale_of() in ppo.h; undefined without scene embeddings of a teacher

  /// Returns a chunk of the minibatch. Padding rows have weight 0.
  Minibatch part(const Chunk& chunk) const;
};

/// Transitions of a rollout in an epoch's order, split into minibatches whose sizes differ by at most one. Order and
/// minibatches do not depend on the number of ranks.
class Minibatches {
 public:
  /// max_size: maximum size over all ranks. rows: i64 [n], this rank's transitions in ascending order.
  Minibatches(const at::Tensor& rows, const Rollout& rollout, int64_t max_size, LearnerExecutor* executor,
              Communicator* communicator);

  /// Transitions per epoch over all ranks.
  int64_t global_size() const { return global_size_; }
  /// Minibatches per epoch.
  int64_t count() const { return count_; }

  /// Puts the transitions into an epoch's order.
  void shuffle(uint64_t seed, int64_t update, int64_t epoch);
  /// Returns minibatch m without advantages.
  Minibatch operator[](int64_t m) const;
  /// Returns the number of this rank's transitions among the epoch's first `count`.
  int64_t count_own_among_first(int64_t count) const;

 private:
  LearnerExecutor* const executor_;
  int64_t global_size_ = 0, count_ = 0;
  at::Tensor own_;     // i64 [global_size_], rows or kOfAnotherRank
  at::Tensor rows_;    // own rows in the epoch's order
  at::Tensor places_;  // [rows_] index among all ranks' transitions
  at::Tensor begins_;  // [count_ + 1] offsets of minibatches in rows_; on the host
};

}  // namespace pictura
