// Minibatches of an update's transitions, shared by all ranks.
#pragma once

#include "pictura/policy/chunks.h"
#include "pictura/training/ranks/communicator.h"
#include "pictura/training/rollout.h"

namespace pictura {

/// This rank's transitions of a minibatch, or of a part of it.
struct Minibatch {
  at::Tensor rows;          // i64 [n], rows of the rollout
  int64_t global_size = 0;  // number of transitions of the minibatch over all ranks
  at::Tensor advantages;    // [n], as the losses read them: normalised if train.norm_adv is set
  at::Tensor shares;        // [n], weight of each row in means; undefined if all weights are 1

  /// Returns the part of the minibatch for a chunk of `rows`. Padding rows have weight 0.
  Minibatch part(const Chunk& chunk) const;
};

/// Transitions of a rollout in the order of an epoch, split into minibatches whose sizes differ by at most one
/// transition. Order and minibatches do not depend on the number of ranks. Each rank holds only its own transitions of
/// a minibatch.
class Minibatches {
 public:
  /// Creates minibatches of at most max_size transitions over all ranks. rows: i64 [n], this rank's transitions in
  /// ascending order.
  Minibatches(const at::Tensor& rows, const Rollout& rollout, int64_t max_size, LearnerExecutor* executor,
              Communicator* communicator);

  /// Returns the number of transitions over all ranks.
  int64_t global_size() const { return global_size_; }
  /// Minibatches per epoch.
  int64_t count() const { return count_; }

  /// Puts the transitions into an epoch's order.
  void shuffle(uint64_t seed, int64_t update, int64_t epoch);
  /// Returns minibatch m in the order of the last shuffle(), without advantages.
  Minibatch operator[](int64_t m) const;
  /// Returns the number of this rank's transitions among the first `count` transitions of the epoch.
  int64_t count_own_among_first(int64_t count) const;

 private:
  LearnerExecutor* const executor_;
  int64_t global_size_ = 0, count_ = 0;
  at::Tensor own_;     // i64 [global_size_] row of each transition, or kOfAnotherRank
  at::Tensor rows_;    // this rank's rows in the epoch's order
  at::Tensor places_;  // [rows_] index of each row among all ranks' transitions in the epoch's order
  at::Tensor begins_;  // [count_ + 1] offset of each minibatch in rows_; on the host
};

}  // namespace pictura
