// An update as the paper's algorithm has it: collect a rollout from the policy's own driving, improve the policy on it.
#pragma once

#include <vector>

#include "pictura/policy/decision_clock.h"
#include "pictura/training/run.h"

namespace pictura {

class Collector {
 public:
  /// The run must outlive it.
  explicit Collector(Run* run);

  /// Fills the run's rollout; false when ^C came. Several ranks hear of it after the update.
  bool collect();

  /// Of steps, that have been launched so far.
  int64_t num_graph_launches() const { return graphs_.num_launches(); }

 private:
  bool collect_on_stream();
  // Keeps what the simulator shows as what is seen at a step. Returns the slots of the agents that decide.
  at::Tensor record(int64_t step);
  // Has the agents that do not decide at a step go on with their actions of the step before.
  void hold_actions(int64_t step, const at::Tensor& deciding);
  // Keeps what the teacher would do at a step, as long as it weighs anything.
  void ask_teacher(int64_t step, const at::Tensor& slots);
  void simulate(int64_t step);

  Run& run_;
  DecisionClock clock_;
  Graphs graphs_;
  std::vector<RepeatedWork> records_, simulations_;  // of each step, whose part of the rollout they write
};

/// Improves the run's policy on its rollout. Throws what ppo_update throws.
UpdateStats improve(Run* run);

}  // namespace pictura
