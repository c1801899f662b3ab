// Teacher: a saved policy that another one learns to imitate while it drives. For agents that the learner drives it
// gives its own actions' probabilities, from the observations that it was trained with.
#pragma once

#include <memory>

#include "pictura/policy/policy.h"
#include "pictura/policy/saved_policy.h"

namespace pictura {

class Teacher {
 public:
  /// Teacher for a learner of `config`, on `device`. Throws Error naming the teacher's file where it reads images, or
  /// slots of the ego vector that the learner must not have.
  Teacher(const SavedPolicy& saved, const Config& config, Device device);

  /// Adds the arrays that the teacher reads to those that a simulator makes.
  void add_arrays(SimulatorConfig* config_inout) const;

  /// Log-probabilities of all actions for the agents of some slots, i64 [n], of what the simulator shows now: f32
  /// [n, kNumActions], without gradients.
  at::Tensor log_probs(const SimulatorArrays& input, const at::Tensor& slots) const;

 private:
  const Config config_;  // of the teacher
  const ChunkSizes chunks_;
  const Device device_;
  const std::unique_ptr<const Policy> policy_;
};

}  // namespace pictura
