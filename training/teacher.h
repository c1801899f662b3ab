// Teacher: a saved policy that the learner imitates while the learner drives. The teacher computes its own action
// probabilities for the learner's agents, from the observations with which it was trained.
#pragma once

#include <memory>

#include "pictura/policy/policy.h"
#include "pictura/policy/saved_policy.h"

namespace pictura {

class Teacher {
 public:
  /// Creates, on `device`, the teacher of a learner with the configuration `config`. Throws Error naming the teacher's
  /// file if the teacher reads images. Also throws if both policies read vectors and only one of them reads auxiliary
  /// slots (observed numbers that no image shows).
  Teacher(const SavedPolicy& saved, const Config& config, Device device);

  /// Adds to a simulator's configuration the observation arrays that the teacher reads.
  void add_arrays(SimulatorConfig* config_inout) const;

  /// Returns the log-probabilities of all actions for the agents of `slots`, i64 [n], from the simulator's current
  /// observations: f32 [n, kNumActions], without gradients.
  at::Tensor log_probs(const SimulatorArrays& input, const at::Tensor& slots) const;

 private:
  const Config config_;  // configuration of the teacher
  const ChunkSizes chunks_;
  const Device device_;
  const std::unique_ptr<const Policy> policy_;
};

}  // namespace pictura
