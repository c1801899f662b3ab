// Collector of a run's rollouts.
#pragma once

#include <vector>

#include "pictura/policy/decision_clock.h"
#include "pictura/training/run.h"

namespace pictura {

class Collector {
 public:
  /// The run must outlive the collector.
  explicit Collector(Run* run);

  /// Fills the run's rollout, except advantages. Returns false after an interrupt (^C). With several ranks, an
  /// interrupt takes effect only after the update.
  bool collect();
  void forget_worlds();

  /// Graph launches so far.
  int64_t num_graph_launches() const { return graphs_.num_launches(); }

 private:
  bool collect_on_stream();
  // Returns the slots of the agents that decide (select a new action).
  at::Tensor record(int64_t step);
  // Repeats the previous actions of the other agents.
  void repeat_held_actions(int64_t step, const at::Tensor& deciding);
  // Records what the losses use of the teacher's decisions. Does not run the teacher if its weights are 0.
  void record_teacher(int64_t step, const at::Tensor& slots);
  void simulate(int64_t step);

  Run& run_;
  DecisionClock clock_;
  Graphs graphs_;
  std::vector<RepeatedWork> records_, simulations_;  // [steps]
};

}  // namespace pictura
