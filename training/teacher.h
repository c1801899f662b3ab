// Teacher: a saved policy that the learner imitates.
#pragma once

#include <memory>

#include "pictura/policy/policy.h"
#include "pictura/policy/saved_policy.h"

namespace pictura {

class Teacher {
 public:
  /// config: configuration of the learner. Throws Error naming the teacher's file if the teacher reads images. Throws
  /// Error if both policies read vectors and only one reads auxiliary slots (observed numbers that no image shows).
  Teacher(const SavedPolicy& saved, const Config& config, Device device);

  /// Adds the observation arrays that the teacher reads.
  void add_arrays(SimulatorConfig* config_inout) const;

  /// Returns log-probabilities of all actions for the agents of `slots`, i64 [n], from current observations: f32 [n,
  /// kNumActions], without gradients.
  at::Tensor log_probs(const SimulatorArrays& input, const at::Tensor& slots) const;

 private:
  const Config config_;  // the teacher's configuration
  const ChunkSizes chunks_;
  const Device device_;
  const std::unique_ptr<const Policy> policy_;
};

}  // namespace pictura
