// Collecting a rollout from the policy's own driving.
#pragma once

#include <vector>

#include "pictura/policy/decision_clock.h"
#include "pictura/training/run.h"

namespace pictura {

class Collector {
 public:
  /// The run must outlive it.
  explicit Collector(Run* run);

  /// Fills the run's rollout, but for advantages; false when ^C came. Several ranks hear of it after the update.
  bool collect();

  /// Graphs of steps that have been launched so far.
  int64_t num_graph_launches() const { return graphs_.num_launches(); }

 private:
  bool collect_on_stream();
  // Records what the simulator shows as what is seen at a step. Returns the slots of the agents that decide.
  at::Tensor record(int64_t step);
  // Repeats the actions of the step before for agents that do not decide.
  void hold_actions(int64_t step, const at::Tensor& deciding);
  // Records what the teacher would do at a step, as long as it weighs anything.
  void ask_teacher(int64_t step, const at::Tensor& slots);
  void simulate(int64_t step);

  Run& run_;
  DecisionClock clock_;
  Graphs graphs_;
  std::vector<RepeatedWork> records_, simulations_;  // by step, whose part of the rollout they write
};

}  // namespace pictura
