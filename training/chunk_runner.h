// Runs a policy on chunks of a rollout's rows: gathers observations, evaluates the policy, and computes the gradients
// of losses. With CUDA graphs a chunk takes tens of launches instead of hundreds, and gives the same bits.
#pragma once

#include <functional>
#include <map>

#include "pictura/policy/policy.h"
#include "pictura/training/loss_stats.h"
#include "pictura/training/minibatches.h"
#include "pictura/training/repeated_work.h"

namespace pictura {

/// Targets of all of a rollout's transitions, which losses read by row: [steps * slots].
struct Targets {
  at::Tensor actions;            // i64
  at::Tensor old_log_probs;      // log-probabilities of these actions
  at::Tensor returns;            // in units of rewards
  at::Tensor teacher_log_probs;  // [steps * slots, kNumActions], of all actions; undefined without a teacher
  at::Tensor teacher_weight;     // [], weight of the KL divergence from the teacher; undefined without one
};

/// Losses of a chunk: means over its rows, with gradients.
struct Losses {
  at::Tensor total;                   // the minimised loss: the sum of the others times their coefficients
  at::Tensor policy, value, entropy;  // without coefficients
  at::Tensor stats;                   // stacked() statistics, without gradients
};

/// Computes the losses of a chunk from the policy's output. With graphs it is called only during capture, so every call
/// must do the same work.
using LossFunction =
    std::function<Losses(const Policy::Output& output, const Targets& targets, const Minibatch& chunk)>;

class ChunkRunner {
 public:
  /// The arguments must outlive the runner. If `graphs` is null, nothing is captured.
  ChunkRunner(const Policy& policy, const RolloutObservations& observations, PhaseTimer* timer = nullptr,
              Graphs* graphs = nullptr);

  /// Returns the policy's output for rows, i64 [n], of a rollout, without gradients: Phase::forward. Valid until the
  /// next call.
  Policy::Output act(const at::Tensor& rows);

  /// Returns the policy's output in the update's arithmetic, without gradients and without graphs: Phase::learn.
  Policy::Output forward_no_grad(const at::Tensor& rows);

  /// Sets the targets of the losses that follow.
  void set_targets(const Targets& targets);
  /// Adds the gradient of this rank's part of a minibatch's loss to those of the parameters, which must be defined, in
  /// chunks of at most forward_chunk rows: Phase::learn and Phase::backward. Returns the statistics of that part, f64
  /// [kNumLossStats] with 0 for the gradient norm, which remain valid until the next call.
  at::Tensor add_gradients(const Minibatch& minibatch, int64_t forward_chunk, const LossFunction& loss);
  /// Losses of one chunk, from which gradients can be computed, without graphs: Phase::diagnose.
  Losses losses(const Minibatch& chunk, const LossFunction& loss);

  /// Discards all graphs. Must be called if the observations' images move, as with another renderer.
  void clear();

 private:
  // Graphs and tensors for chunks of one size. Tensors that graphs read have a fixed address: values are copied to
  // them.
  struct Work {
    RepeatedWork observe, act, learn, backward;
    Minibatch chunk;
    Observation observation;
    Policy::Output output;
    at::Tensor weight;  // weight of the chunk in its minibatch
    Losses losses;
    int64_t last_use = 0;
  };
  // Maximum number of sizes with graphs. Beyond it the graphs of the least recently used size are discarded.
  static constexpr size_t kMaxSizes = 8;

  Work& work_of(int64_t size);
  Work& observe(const at::Tensor& rows);
  void set(at::Tensor* to, const at::Tensor& value) const;

  const Policy& policy_;
  const RolloutObservations& observations_;
  PhaseTimer* const timer_;
  Graphs own_graphs_;
  Graphs* const graphs_;
  uint64_t generation_ = 0;  // RolloutObservations::generation() of the graphs
  int64_t num_uses_ = 0;
  std::map<int64_t, Work> works_;  // by size; without graphs a single entry for all sizes
  Targets targets_;
  at::Tensor stats_;  // sums over the chunks of a minibatch
};

}  // namespace pictura
