// A policy at work on chunks of a rollout's rows: what they see, what it makes of that, and what it learns from it.
// With graphs a chunk takes some ten launches instead of some hundreds, and gives the same bits.
#pragma once

#include <map>

#include "pictura/training/losses.h"
#include "pictura/training/phase_timer.h"
#include "pictura/training/repeated_work.h"
#include "pictura/training/rollout.h"

namespace pictura {

class ChunkRunner {
 public:
  /// All must outlive it. `graphs` may be null: then nothing is captured.
  ChunkRunner(const Policy& policy, const RolloutObservations& observations, PhaseTimer* timer = nullptr,
              Graphs* graphs = nullptr);

  /// What the policy makes of rows, i64 [size], without gradients: Phase::forward. Valid until the next call.
  Policy::Output act(const at::Tensor& rows);

  /// The learner's arithmetic without gradients, call by call: Phase::learn.
  Policy::Output look(const at::Tensor& rows);

  /// What is learnt from then on.
  void set_targets(const Targets& targets);
  /// Sets stats() to 0.
  void begin_minibatch();
  /// Adds the gradient of a chunk's loss times `weight` to those of the parameters, which must be defined, and its
  /// stats times `weight` to stats(). shares: see losses_of. Phase::learn and Phase::backward.
  void learn(const at::Tensor& rows, const at::Tensor& advantages, const at::Tensor& shares, double weight,
             const TrainSection& config);
  /// The losses of a chunk with their ways back, call by call: Phase::diagnose.
  Losses losses(const at::Tensor& rows, const at::Tensor& advantages, const at::Tensor& shares,
                const TrainSection& config);
  /// f64 [kNumStats], where those of all chunks since begin_minibatch() are added up; the last, the norm, is 0.
  const at::Tensor& stats() const { return stats_; }
  static constexpr int64_t kNumStats = 8;  // of LossStats

  /// Forgets all graphs. Must be called where the observations' images move, as with another renderer.
  void clear();

 private:
  // The chunks of one size. Tensors that graphs read have one address: they are copied to.
  struct Work {
    RepeatedWork observe, act, learn, backward;
    at::Tensor rows;
    Observation observation;
    Policy::Output output;
    at::Tensor advantages, shares, weight;
    Losses losses;
    int64_t last_use = 0;
  };
  // Where there are more, the graphs of the size that was last used longest ago go.
  static constexpr size_t kMostSizes = 8;

  Work& work_of(int64_t size);
  Work& observe(const at::Tensor& rows);
  void set(at::Tensor* to, const at::Tensor& value) const;

  const Policy& policy_;
  const RolloutObservations& observations_;
  PhaseTimer* const timer_;
  Graphs own_graphs_;
  Graphs* const graphs_;
  uint64_t generation_ = 0;  // of the observations' graphs
  int64_t num_uses_ = 0;
  std::map<int64_t, Work> works_;  // by size; without graphs one of any size
  Targets targets_;
  at::Tensor stats_;
};

}  // namespace pictura
