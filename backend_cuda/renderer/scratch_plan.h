// Division of the CUDA renderer's scratch memory (all except images, scenes and maps).
#pragma once

#include <cstddef>

namespace pictura::cuda {

/// Scratch memory with which drawing is fastest.
struct ScratchNeeds {
  int large_blocks = 1;  // blocks of the overflow launch
  std::size_t large_block_bytes = 0;
  std::size_t views = 1, view_bytes = 0;
  std::size_t pool_bytes = 0;  // for any number of views
};

/// Amounts that fit into the available memory.
struct ScratchPlan {
  int large_blocks = 0;
  std::size_t views = 0;  // drawn together; larger batches are split
};

std::size_t bytes_of(const ScratchPlan& plan, const ScratchNeeds& needs);

/// Plans as much of `needs` as fits into max_bytes: views first, then blocks. Throws Error with the minimum in bytes if
/// one view and one block do not fit.
ScratchPlan plan_scratch(const ScratchNeeds& needs, std::size_t max_bytes);

}  // namespace pictura::cuda
