// Collects a rollout: the policy drives, and its observations, actions and results are recorded.
#pragma once

#include <vector>

#include "pictura/policy/decision_clock.h"
#include "pictura/training/run.h"

namespace pictura {

class Collector {
 public:
  /// Creates a collector of a run, which must outlive it.
  explicit Collector(Run* run);

  /// Fills the run's rollout, except advantages. Returns false after an interrupt (^C). With several ranks, an
  /// interrupt takes effect only after the update.
  bool collect();
  /// Releases graphs of the simulator's previous worlds.
  void forget_worlds();

  /// Graph launches of all steps so far.
  int64_t num_graph_launches() const { return graphs_.num_launches(); }

 private:
  bool collect_on_stream();
  // Records the simulator's observations of a step. Returns the slots of the agents that decide, that is, select a new
  // action.
  at::Tensor record(int64_t step);
  // Repeats the previous step's actions of agents that do not decide.
  void repeat_held_actions(int64_t step, const at::Tensor& deciding);
  // Records the teacher's log-probabilities at a step if the teacher's weight is not 0.
  void record_teacher_log_probs(int64_t step, const at::Tensor& slots);
  void simulate(int64_t step);

  Run& run_;
  DecisionClock clock_;
  Graphs graphs_;
  std::vector<RepeatedWork> records_, simulations_;  // [steps] work that writes each step of the rollout
};

}  // namespace pictura
