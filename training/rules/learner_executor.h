// Executor of this folder's rules on rollouts, with bit-identical results on hosts and CUDA devices.
#pragma once

#include "pictura/policy/rules/policy_executor.h"
#include "pictura/training/rules/gae.h"
#include "pictura/training/rules/permutation.h"

namespace pictura {

/// Executor for learning.
class LearnerExecutor : public PolicyExecutor {
 public:
  /// Computes generalized advantages, [steps, slots], see gae.h.
  virtual void compute_advantages(const TransitionArrays& transitions, float gamma, float gae_lambda,
                                  Span<float> advantages_out, Stream stream = {}) = 0;
  /// Counts valid transitions in bins of |advantage| (advantage_filter.h). counts_inout: [kNumFilterBins].
  virtual void count_advantages(Span<const float> advantages, Span<const uint8_t> valid, Span<int64_t> counts_inout,
                                Stream stream = {}) = 0;
  /// Writes the transitions that the filter keeps, in ascending order, and returns their number. kept_out has room for
  /// all.
  virtual int64_t select_kept(Span<const float> advantages, Span<const uint8_t> valid, float threshold,
                              Span<int64_t> kept_out, Stream stream = {}) = 0;
  /// items_out[i] = items[permutation(i)].
  virtual void permute(const Permutation& permutation, Span<const int64_t> items, Span<int64_t> items_out,
                       Stream stream = {}) = 0;
};

}  // namespace pictura
