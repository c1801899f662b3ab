// Images that a rollout keeps for updates.
#pragma once

#include <cstdint>
#include <vector>

#include "pictura/policy/observation.h"

namespace pictura {

/// Images of the agents that select a new action.
class KeptImages {
 public:
  /// Allocates memory for `capacity` images, which grows if necessary.
  KeptImages(const Rig& rig, int64_t num_steps, int64_t num_slots, int64_t capacity, Device device);

  /// Stores the images [n, cameras, ...] of `slots`, i64 [n]. Step 0 discards all previous images.
  void put(int64_t step, const at::Tensor& slots, const std::vector<ImageBlock>& images);
  /// Returns the images of rows, i64 [batch]; a row is step * num_slots + slot.
  std::vector<ImageBlock> gather(const at::Tensor& rows) const;
  /// Number of times that the memory has moved.
  uint64_t generation() const { return generation_; }

 private:
  std::vector<ImageBlock> images_;  // [capacity, cameras, ...]
  at::Tensor place_of_row_;         // i64 [num_steps, num_slots], index in images_
  int64_t count_ = 0;
  uint64_t generation_ = 0;
};

}  // namespace pictura
