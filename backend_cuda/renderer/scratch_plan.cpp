#include "pictura/backend_cuda/renderer/scratch_plan.h"

#include <algorithm>

#include "pictura/common/error.h"

namespace pictura::cuda {

namespace {

// Returns how many of `wanted` items fit into *left_inout bytes, and subtracts their size.
std::size_t take(std::size_t wanted, std::size_t bytes_each, std::size_t* left_inout) {
  const std::size_t taken = bytes_each == 0 ? wanted : std::min(wanted, *left_inout / bytes_each);
  *left_inout -= taken * bytes_each;
  return taken;
}

}  // namespace

std::size_t bytes_of(const ScratchPlan& plan, const ScratchNeeds& needs) {
  return static_cast<std::size_t>(plan.large_blocks) * needs.large_block_bytes + plan.views * needs.view_bytes +
         needs.pool_bytes;
}

ScratchPlan plan_scratch(const ScratchNeeds& needs, std::size_t max_bytes) {
  ScratchPlan plan{1, 1};
  const std::size_t min_bytes = bytes_of(plan, needs);
  PICTURA_CHECK(min_bytes <= max_bytes, "renderer cuda: max_scratch_bytes: expected at least {}, got {}", min_bytes,
                max_bytes);
  std::size_t left = max_bytes - min_bytes;
  plan.views += take(needs.views - 1, needs.view_bytes, &left);
  plan.large_blocks +=
      static_cast<int>(take(static_cast<std::size_t>(needs.large_blocks - 1), needs.large_block_bytes, &left));
  return plan;
}

}  // namespace pictura::cuda
