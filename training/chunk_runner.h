// Runs a policy and its losses on chunks of a rollout's rows (agent slots at steps). CUDA graphs save most launches,
// with bit-identical results.
#pragma once

#include <functional>
#include <map>

#include "pictura/policy/policy.h"
#include "pictura/training/loss_stats.h"
#include "pictura/training/minibatches.h"
#include "pictura/training/repeated_work.h"

namespace pictura {

/// Targets of a rollout's transitions, [steps * slots].
struct Targets {
  at::Tensor actions;            // i64
  at::Tensor old_log_probs;      // for these actions
  at::Tensor returns;            // in units of rewards
  at::Tensor teacher_log_probs;  // [steps * slots, kNumActions]; undefined without a teacher
  at::Tensor teacher_weight;     // scalar, weight of the teacher's KL divergence; undefined without a teacher
  at::Tensor teacher_scene;      // [steps * slots, width], the teacher's scene embeddings; undefined without them
};

/// Losses of a chunk: means over rows, with gradients.
struct Losses {
  at::Tensor total;                   // sum of losses times coefficients, to minimise
  at::Tensor policy, value, entropy;  // without coefficients
  at::Tensor stats;                   // stacked() statistics, without gradients
};

/// Computes a chunk's losses. CUDA graphs do not call it again after capture, so each call must do the same work.
using LossFunction =
    std::function<Losses(const Policy::Output& output, const Targets& targets, const Minibatch& chunk)>;

class ChunkRunner {
 public:
  /// The arguments must outlive the runner. Null `graphs`: nothing is captured.
  ChunkRunner(const Policy& policy, const RolloutObservations& observations, PhaseTimer* timer = nullptr,
              Graphs* graphs = nullptr);

  /// Returns the policy's output without gradients for rows, i64 [n], valid until the next call. Counts as
  /// Phase::forward.
  Policy::Output act(const at::Tensor& rows);

  /// Like act(), but runs the network without CUDA graphs. Counts as Phase::learn.
  Policy::Output forward_no_grad(const at::Tensor& rows);

  /// `teacher_scene` must remain at its address while it is used. Another address discards all graphs.
  void set_targets(const Targets& targets);
  /// Adds the loss gradient of this rank's part of a minibatch to the parameters' gradients, which must be defined.
  /// Computes chunks of at most forward_chunk rows. Returns the part's statistics, f64 [kNumLossStats], valid until the
  /// next call; their grad_norm is 0. Counts as Phase::learn and Phase::backward.
  at::Tensor add_gradients(const Minibatch& minibatch, int64_t forward_chunk, const LossFunction& loss);
  /// Returns one chunk's losses with gradients. Uses no CUDA graphs. Counts as Phase::diagnose.
  Losses losses(const Minibatch& chunk, const LossFunction& loss);

  /// Discards all graphs. Call it if the observations' images move in memory, for instance with another renderer.
  void clear();

 private:
  // Graphs for chunks of one size, with tensors at fixed addresses.
  struct Work {
    RepeatedWork observe, act, learn, backward;
    Minibatch chunk;
    Observation observation;
    Policy::Output output;
    at::Tensor weight;  // the chunk's weight in its minibatch
    Losses losses;
    int64_t last_use = 0;
  };
  // Maximum number of sizes with graphs.
  static constexpr size_t kMaxSizes = 8;

  Work& work_of(int64_t size);
  Work& observe(const at::Tensor& rows);
  void set(at::Tensor* to, const at::Tensor& value) const;

  const Policy& policy_;
  const RolloutObservations& observations_;
  PhaseTimer* const timer_;
  Graphs own_graphs_;
  Graphs* const graphs_;
  uint64_t generation_ = 0;  // RolloutObservations::generation() at capture
  int64_t num_uses_ = 0;
  std::map<int64_t, Work> works_;  // by chunk size; without graphs a single entry
  Targets targets_;
  at::Tensor stats_;  // sums over a minibatch's chunks
};

}  // namespace pictura
