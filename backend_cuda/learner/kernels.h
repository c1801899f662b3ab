// Kernels that the learner's host side launches, one thread per element, asynchronously on a stream. Callers check
// cudaGetLastError().
#pragma once

#include <cuda_runtime_api.h>

#include "pictura/policy/rules/choose_action.h"
#include "pictura/training/rules/gae.h"
#include "pictura/training/rules/permutation.h"

namespace pictura::cuda {

void launch_choose_actions(const ActionRule& rule, Span<const int64_t> slots, const float* log_probs,
                           int32_t* actions_out, cudaStream_t stream);
void launch_write_commands(Span<const int32_t> actions, Span<const uint8_t> mask, Command* commands_out,
                           cudaStream_t stream);
void launch_compute_advantages(const TransitionArrays& transitions, float gamma, float gae_lambda,
                               float* advantages_out, cudaStream_t stream);
void launch_count_advantages(Span<const float> advantages, Span<const uint8_t> valid, int64_t* counts_inout,
                             cudaStream_t stream);
void launch_permute(const Permutation& permutation, Span<const int64_t> items, int64_t* items_out, cudaStream_t stream);

/// Rule that selects the transitions that the advantage filter keeps. select() writes the selected indices in [0,
/// count), in ascending order, and their number. If `scratch` is null, it only returns the required scratch bytes.
struct KeptTransitions {
  Span<const float> advantages;
  Span<const uint8_t> valid;
  float threshold;
};
cudaError_t select(const DecidingSlots& rule, int64_t count, int64_t* items_out, int64_t* num_items_out, void* scratch,
                   size_t* scratch_bytes_inout, cudaStream_t stream);
cudaError_t select(const KeptTransitions& rule, int64_t count, int64_t* items_out, int64_t* num_items_out,
                   void* scratch, size_t* scratch_bytes_inout, cudaStream_t stream);

}  // namespace pictura::cuda
