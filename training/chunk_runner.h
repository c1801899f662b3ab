// Runs a policy on chunks of a rollout's rows: gathers observations, evaluates the policy, and computes the gradients
// of losses. A row is one agent slot at one step. CUDA graphs reduce the launches for a chunk from hundreds to tens;
// results are bit-identical.
#pragma once

#include <functional>
#include <map>

#include "pictura/policy/policy.h"
#include "pictura/training/loss_stats.h"
#include "pictura/training/minibatches.h"
#include "pictura/training/repeated_work.h"

namespace pictura {

/// Targets of all transitions of a rollout, [steps * slots]. Losses read them by row.
struct Targets {
  at::Tensor actions;            // i64
  at::Tensor old_log_probs;      // log-probabilities of these actions
  at::Tensor returns;            // in units of rewards
  at::Tensor teacher_log_probs;  // for all actions, [steps * slots, kNumActions]; undefined without a teacher
  at::Tensor teacher_weight;     // scalar, weight of the KL divergence from the teacher; undefined without a teacher
};

/// Losses of a chunk: means over its rows, with gradients.
struct Losses {
  at::Tensor total;                   // loss to minimise: sum of all losses times their coefficients
  at::Tensor policy, value, entropy;  // not multiplied by their coefficients
  at::Tensor stats;                   // stacked() statistics, without gradients
};

/// Computes the losses of a chunk from the policy's output. With CUDA graphs it is not called again after its work is
/// captured, so every call must do the same work.
using LossFunction =
    std::function<Losses(const Policy::Output& output, const Targets& targets, const Minibatch& chunk)>;

class ChunkRunner {
 public:
  /// The arguments must outlive the runner. If `graphs` is null, nothing is captured.
  ChunkRunner(const Policy& policy, const RolloutObservations& observations, PhaseTimer* timer = nullptr,
              Graphs* graphs = nullptr);

  /// Returns the policy's output, without gradients, for rows (i64 [n]) of a rollout. The output is valid until the
  /// next call. The time counts as Phase::forward.
  Policy::Output act(const at::Tensor& rows);

  /// Returns the policy's output without gradients, computed as in updates but without CUDA graphs. The time counts as
  /// Phase::learn.
  Policy::Output forward_no_grad(const at::Tensor& rows);

  /// Sets the targets of subsequent losses.
  void set_targets(const Targets& targets);
  /// Adds the gradient of the loss on this rank's part of a minibatch to the parameters' gradients, which must be
  /// defined. Computes it in chunks of at most forward_chunk rows. The time counts as Phase::learn and Phase::backward.
  /// Returns the statistics of this rank's part, f64 [kNumLossStats], with 0 for the gradient norm. They are valid
  /// until the next call.
  at::Tensor add_gradients(const Minibatch& minibatch, int64_t forward_chunk, const LossFunction& loss);
  /// Returns the losses of one chunk, from which gradients can be computed. Uses no CUDA graphs. The time counts as
  /// Phase::diagnose.
  Losses losses(const Minibatch& chunk, const LossFunction& loss);

  /// Discards all graphs. Must be called if the addresses of the observations' images change, for instance with another
  /// renderer.
  void clear();

 private:
  // Graphs and tensors for chunks of one size. Tensors that graphs read have a fixed address, so values are copied into
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
  // Maximum number of sizes with graphs. For a further size, the graphs of the least recently used size are discarded.
  static constexpr size_t kMaxSizes = 8;

  Work& work_of(int64_t size);
  Work& observe(const at::Tensor& rows);
  void set(at::Tensor* to, const at::Tensor& value) const;

  const Policy& policy_;
  const RolloutObservations& observations_;
  PhaseTimer* const timer_;
  Graphs own_graphs_;
  Graphs* const graphs_;
  uint64_t generation_ = 0;  // RolloutObservations::generation() when graphs were captured
  int64_t num_uses_ = 0;
  std::map<int64_t, Work> works_;  // by chunk size; without graphs a single entry for all sizes
  Targets targets_;
  at::Tensor stats_;  // sums over the chunks of a minibatch
};

}  // namespace pictura
