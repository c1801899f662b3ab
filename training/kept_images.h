// Images of a rollout, kept from the step at which they are drawn until updates have learnt from them.
#pragma once

#include <cstdint>
#include <vector>

#include "pictura/policy/observation.h"

namespace pictura {

/// Images of the agents that select a new action, stored consecutively. Agents that repeat their last action, and
/// halted agents, take no memory.
class KeptImages {
 public:
  /// Allocates memory for `capacity` images of the rig; the memory grows if necessary. There are num_steps * num_slots
  /// rows.
  KeptImages(const Rig& rig, int64_t num_steps, int64_t num_slots, int64_t capacity, Device device);

  /// Stores the images of `slots`, i64 [n], at `step`. images: blocks [n, cameras, ...]. Step 0 discards all previous
  /// images.
  void put(int64_t step, const at::Tensor& slots, const std::vector<ImageBlock>& images);
  /// Returns the stored images of `rows`, i64 [batch]; a row is step * num_slots + slot.
  std::vector<ImageBlock> gather(const at::Tensor& rows) const;
  /// Number of times that the memory has moved.
  uint64_t generation() const { return generation_; }

 private:
  std::vector<ImageBlock> images_;  // [capacity, cameras, ...]
  at::Tensor place_of_row_;         // i64 [num_steps, num_slots], index of a row's images in images_
  int64_t count_ = 0;
  uint64_t generation_ = 0;
};

}  // namespace pictura
