// How the CUDA renderer divides the memory that it may use beyond images, scenes and maps.
#pragma once

#include <cstddef>

namespace pictura::cuda {

/// What would serve best.
struct ScratchNeeds {
  int large_blocks = 1;  // of the last launch
  std::size_t large_block_bytes = 0;
  std::size_t views = 1, view_bytes = 0;  // of the batch, and what each of them takes
  std::size_t pool_bytes = 0;             // of the pool, however few they are
};

/// What there is room for.
struct ScratchPlan {
  int large_blocks = 0;
  std::size_t views = 0;  // drawn at once; batches of more are drawn in parts
};

std::size_t bytes_of(const ScratchPlan& plan, const ScratchNeeds& needs);

/// As much of the needs as max_bytes hold, at least one of each: views, then blocks of the last launch, which has
/// little to do. Throws Error saying how many bytes one of each takes, where they do not fit.
ScratchPlan plan_scratch(const ScratchNeeds& needs, std::size_t max_bytes);

}  // namespace pictura::cuda
