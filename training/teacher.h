// Teacher: a saved policy that the learner imitates while the learner drives. It gives its own action probabilities for
// the learner's agents, from the observations of its training.
#pragma once

#include <memory>

#include "pictura/policy/policy.h"
#include "pictura/policy/saved_policy.h"

namespace pictura {

class Teacher {
 public:
  /// Creates the teacher of a learner of `config`, on `device`. Throws Error naming the teacher's file if it reads
  /// images, or slots of the ego vector that the learner must not have.
  Teacher(const SavedPolicy& saved, const Config& config, Device device);

  /// Adds the arrays that the teacher reads to those that a simulator writes.
  void add_arrays(SimulatorConfig* config_inout) const;

  /// Log-probabilities of all actions for the agents of these slots, i64 [n], from the simulator's present
  /// observations: f32 [n, kNumActions], without gradients.
  at::Tensor log_probs(const SimulatorArrays& input, const at::Tensor& slots) const;

 private:
  const Config config_;  // configuration of the teacher
  const ChunkSizes chunks_;
  const Device device_;
  const std::unique_ptr<const Policy> policy_;
};

}  // namespace pictura
