// The images of a rollout, kept from the step at which they are seen to the updates that learn from them.
#pragma once

#include <cstdint>
#include <vector>

#include "pictura/policy/observation.h"

namespace pictura {

/// Images of the agents that decide, one after the other: held actions and agents that have halted take no room.
class KeptImages {
 public:
  /// Room for so many images of the rig, of num_steps x num_slots rows; where it does not suffice, it grows.
  KeptImages(const Rig& rig, int64_t num_steps, int64_t num_slots, int64_t capacity, Device device);

  /// Keeps what these slots, i64 [n], saw at `step`: blocks of [n, cameras, ...]. At step 0 all others are forgotten.
  void put(int64_t step, const at::Tensor& slots, const std::vector<ImageBlock>& images);
  /// The images of rows, i64 [batch] of step * num_slots + slot, that have been put.
  std::vector<ImageBlock> gather(const at::Tensor& rows) const;
  /// How often the memory has moved.
  uint64_t generation() const { return generation_; }

 private:
  std::vector<ImageBlock> images_;  // [capacity, cameras, ...]
  at::Tensor place_of_row_;         // i64 [num_steps, num_slots], of the images
  int64_t count_ = 0;
  uint64_t generation_ = 0;
};

}  // namespace pictura
