// Executor of a learner's work outside its network: it applies the rules of this folder to whole rollouts. The
// executors for the host and for CUDA devices give bit-identical results.
#pragma once

#include "pictura/policy/rules/policy_executor.h"
#include "pictura/training/rules/gae.h"
#include "pictura/training/rules/permutation.h"

namespace pictura {

/// Executor for learning; as a PolicyExecutor it also serves policies that only drive.
class LearnerExecutor : public PolicyExecutor {
 public:
  /// Computes generalized advantages, see gae.h. advantages_out: [steps, slots].
  virtual void compute_advantages(const TransitionArrays& transitions, float gamma, float gae_lambda,
                                  Span<float> advantages_out, Stream stream = {}) = 0;
  /// Counts the valid transitions in the bins of their |advantages|, see advantage_filter.h. counts_inout:
  /// [kNumFilterBins].
  virtual void count_advantages(Span<const float> advantages, Span<const uint8_t> valid, Span<int64_t> counts_inout,
                                Stream stream = {}) = 0;
  /// Writes the transitions that the advantage filter keeps, in ascending order, see advantage_filter.h. kept_out has
  /// room for all transitions. Returns the number of kept transitions.
  virtual int64_t select_kept(Span<const float> advantages, Span<const uint8_t> valid, float threshold,
                              Span<int64_t> kept_out, Stream stream = {}) = 0;
  /// Permutes items: items_out[i] = items[permutation(i)].
  virtual void permute(const Permutation& permutation, Span<const int64_t> items, Span<int64_t> items_out,
                       Stream stream = {}) = 0;
};

}  // namespace pictura
