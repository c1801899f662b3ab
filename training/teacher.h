// Teacher: a saved policy that the learner imitates.
#pragma once

#include <memory>

#include "pictura/common/renderer.h"
#include "pictura/policy/policy.h"
#include "pictura/policy/saved_policy.h"

namespace pictura {

class Teacher {
 public:
  /// config: configuration of the learner. Throws Error naming the teacher's file if both policies read vectors and
  /// only one reads auxiliary slots (observed numbers that no image shows).
  Teacher(const SavedPolicy& saved, const Config& config, Device device);

  /// Adds the observation arrays that the teacher reads.
  void add_arrays(SimulatorConfig* config_inout) const;
  /// Prepares to draw the simulator's maps. The teacher's cameras are those of its training, without randomization.
  void enter(const Simulator& simulator);

  /// Returns the teacher's decision for the agents of `slots`, i64 [n], from current observations. An image teacher
  /// draws its own images; call enter() before.
  Decision decide(const SimulatorArrays& input, const at::Tensor& slots, bool with_scene) const;
  int64_t scene_width() const { return policy_->scene_width(); }

 private:
  const Config config_;  // the teacher's configuration
  const Rig rig_;
  const ChunkSizes chunks_;
  const Device device_;
  const std::unique_ptr<const Policy> policy_;
  std::unique_ptr<Renderer> renderer_;  // null for a teacher that reads vectors
};

}  // namespace pictura
