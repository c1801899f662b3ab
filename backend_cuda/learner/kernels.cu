#include <cub/device/device_select.cuh>
#include <thrust/iterator/counting_iterator.h>

#include "pictura/backend_cuda/learner/kernels.h"
#include "pictura/training/rules/advantage_filter.h"

namespace pictura::cuda {

namespace {

constexpr int kThreads = 256;

template <typename Body>
__global__ void __launch_bounds__(kThreads) run(int64_t count, Body body) {
  const int64_t i = blockIdx.x * int64_t{blockDim.x} + threadIdx.x;
  if (i < count) body(i);
}

template <typename Body>
void launch(int64_t count, const Body& body, cudaStream_t stream) {
  if (count == 0) return;
  run<<<static_cast<unsigned>((count + kThreads - 1) / kThreads), kThreads, 0, stream>>>(count, body);
}

struct ChooseAction {
  ActionRule rule;
  const int64_t* slots;
  const float* log_probs;
  int32_t* actions_out;
  __device__ void operator()(int64_t i) const { actions_out[slots[i]] = rule(slots[i], log_probs + i * kNumActions); }
};

struct WriteCommand {
  const int32_t* actions;
  Span<const uint8_t> mask;
  Command* commands_out;
  __device__ void operator()(int64_t slot) const { write_command(actions, mask, slot, commands_out); }
};

// A thread processes all steps of a slot, from last to first. Neighbouring threads read neighbouring slots.
struct ComputeAdvantages {
  TransitionArrays transitions;
  float gamma, gae_lambda;
  float* advantages_out;
  __device__ void operator()(int64_t slot) const {
    GaeTail tail = transitions.tail(slot);
    for (int64_t step = transitions.num_steps - 1; step >= 0; --step) {
      advantages_out[step * transitions.num_slots + slot] =
          gae_advantage(transitions.at(step, slot), gamma, gae_lambda, &tail);
    }
  }
};

struct CountAdvantage {
  const float* advantages;
  const uint8_t* valid;
  unsigned long long* counts_inout;
  __device__ void operator()(int64_t i) const {
    if (valid[i] != 0) atomicAdd(counts_inout + filter_bin(advantages[i]), 1ull);
  }
};

struct Permute {
  Permutation permutation;
  const int64_t* items;
  int64_t* items_out;
  __device__ void operator()(int64_t i) const { items_out[i] = items[permutation(i)]; }
};

struct IsKept {
  KeptTransitions rule;
  __device__ bool operator()(int64_t i) const {
    return filter_keeps(rule.advantages[i], rule.valid[i] != 0, rule.threshold);
  }
};

template <typename Predicate>
cudaError_t select_if(const Predicate& predicate, int64_t count, int64_t* items_out, int64_t* num_items_out,
                      void* scratch, size_t* scratch_bytes, cudaStream_t stream) {
  return cub::DeviceSelect::If(scratch, *scratch_bytes, thrust::counting_iterator<int64_t>(0), items_out, num_items_out,
                               count, predicate, stream);
}

}  // namespace

void launch_choose_actions(const ActionRule& rule, Span<const int64_t> slots, const float* log_probs,
                           int32_t* actions_out, cudaStream_t stream) {
  launch(static_cast<int64_t>(slots.size()), ChooseAction{rule, slots.data(), log_probs, actions_out}, stream);
}

void launch_write_commands(Span<const int32_t> actions, Span<const uint8_t> mask, Command* commands_out,
                           cudaStream_t stream) {
  launch(static_cast<int64_t>(actions.size()), WriteCommand{actions.data(), mask, commands_out}, stream);
}

void launch_compute_advantages(const TransitionArrays& transitions, float gamma, float gae_lambda,
                               float* advantages_out, cudaStream_t stream) {
  launch(transitions.num_slots, ComputeAdvantages{transitions, gamma, gae_lambda, advantages_out}, stream);
}

void launch_count_advantages(Span<const float> advantages, Span<const uint8_t> valid, int64_t* counts_inout,
                             cudaStream_t stream) {
  launch(static_cast<int64_t>(advantages.size()),
         CountAdvantage{advantages.data(), valid.data(), reinterpret_cast<unsigned long long*>(counts_inout)}, stream);
}

void launch_permute(const Permutation& permutation, Span<const int64_t> items, int64_t* items_out,
                    cudaStream_t stream) {
  launch(static_cast<int64_t>(items.size()), Permute{permutation, items.data(), items_out}, stream);
}

cudaError_t select(const DecidingSlots& rule, int64_t count, int64_t* items_out, int64_t* num_items_out, void* scratch,
                   size_t* scratch_bytes, cudaStream_t stream) {
  return select_if(rule, count, items_out, num_items_out, scratch, scratch_bytes, stream);
}

cudaError_t select(const KeptTransitions& rule, int64_t count, int64_t* items_out, int64_t* num_items_out,
                   void* scratch, size_t* scratch_bytes, cudaStream_t stream) {
  return select_if(IsKept{rule}, count, items_out, num_items_out, scratch, scratch_bytes, stream);
}

}  // namespace pictura::cuda
