// Minibatches of an update's transitions, which several ranks share.
#pragma once

#include "pictura/policy/chunks.h"
#include "pictura/training/ranks/communicator.h"
#include "pictura/training/rollout.h"

namespace pictura {

/// This rank's transitions of a minibatch, or some of them.
struct Minibatch {
  at::Tensor rows;          // i64 [n], of the rollout
  int64_t global_size = 0;  // transitions of the minibatch, of all ranks
  at::Tensor advantages;    // [n], as the losses take them
  at::Tensor shares;        // [n], what each row counts in means; undefined where each counts as one

  /// Rows of a chunk of `rows`. Those that fill it up count nothing.
  Minibatch part(const Chunk& chunk) const;
};

/// Transitions of a rollout in the order of an epoch, cut into minibatches of equal size, to one transition. Order and
/// minibatches are those that one rank alone would have; of each minibatch a rank takes the transitions that are its
/// own.
class Minibatches {
 public:
  /// rows: i64 [n], this rank's transitions in ascending order. A minibatch has at most max_size of all ranks.
  Minibatches(const at::Tensor& rows, const Rollout& rollout, int64_t max_size, LearnerExecutor* executor,
              Communicator* communicator);

  /// Transitions of all ranks.
  int64_t global_size() const { return global_size_; }
  /// Minibatches per epoch.
  int64_t count() const { return count_; }

  /// Puts the transitions into an epoch's order.
  void shuffle(uint64_t seed, int64_t update, int64_t epoch);
  /// Minibatch m in the order of the last shuffle(), without advantages.
  Minibatch operator[](int64_t m) const;
  /// How many of the first `count` transitions of the epoch are this rank's.
  int64_t own_of_first(int64_t count) const;

 private:
  LearnerExecutor* const executor_;
  int64_t global_size_ = 0, count_ = 0;
  at::Tensor own_;     // i64 [global_size_] row of each transition, kOfAnotherRank where it is not this rank's
  at::Tensor rows_;    // this rank's rows in the epoch's order
  at::Tensor places_;  // of rows_ among all ranks' transitions
  at::Tensor begins_;  // [count_ + 1] where each minibatch begins in rows_; on the host
};

}  // namespace pictura
