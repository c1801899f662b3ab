// Division of the CUDA renderer's memory limit.
#include "pictura/backend_cuda/renderer/scratch_plan.h"

#include <algorithm>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/backend_cuda/renderer/scratch_buffers.h"
#include "pictura/tests/support/error_message.h"

namespace pictura::cuda {
namespace {

constexpr ScratchNeeds kNeeds{
    .large_blocks = 8, .large_block_bytes = 20'000'000, .views = 1'024, .view_bytes = 280'000, .pool_bytes = 300'000};

TEST(ScratchPlan, MeetsAllNeedsWithinTheBound) {
  const ScratchPlan plan = plan_scratch(kNeeds, std::size_t{1} << 30);
  EXPECT_EQ(plan.large_blocks, 8);
  EXPECT_EQ(plan.views, 1'024u);
}

TEST(ScratchPlan, StaysUnderEveryBoundAndUsesMostOfIt) {
  const std::size_t least = bytes_of({1, 1}, kNeeds), most = bytes_of({8, 1'024}, kNeeds);
  for (std::size_t bound = least; bound < most + 100'000; bound += 99'991) {
    const ScratchPlan plan = plan_scratch(kNeeds, bound);
    ASSERT_LE(bytes_of(plan, kNeeds), bound);
    ASSERT_GE(plan.large_blocks, 1);
    ASSERT_GE(plan.views, 1u);
    ASSERT_LE(plan.large_blocks, 8);
    ASSERT_LE(plan.views, 1'024u);
    if (bound > 4 * least) {
      ASSERT_GE(bytes_of(plan, kNeeds), std::min(bound, most) / 2) << bound;
    }
  }
}

TEST(ScratchPlan, ALargeBatchIsDivided) {
  const std::size_t least = bytes_of({1, 1}, kNeeds);
  EXPECT_EQ(plan_scratch(kNeeds, least).views, 1u);
  EXPECT_EQ(plan_scratch(kNeeds, least + 700'000).views, 3u);
}

TEST(ScratchPlan, ViewsComeBeforeBlocksOfTheLastLaunch) {
  const std::size_t all_views = bytes_of({1, 1'024}, kNeeds);
  EXPECT_EQ(plan_scratch(kNeeds, all_views - 1).large_blocks, 1);
  EXPECT_EQ(plan_scratch(kNeeds, all_views + 3 * kNeeds.large_block_bytes).large_blocks, 4);
}

TEST(ScratchPlan, ReportsTheMinimumSize) {
  EXPECT_EQ(test::message_of([] { plan_scratch(kNeeds, 1000); }),
            "renderer cuda: max_scratch_bytes: expected at least 20580000, got 1000");
}

// Host memory that counts its bytes.
std::size_t allocated_bytes = 0;
template <typename Value>
struct CountedBuffer : std::vector<Value> {
  explicit CountedBuffer(std::size_t size) : std::vector<Value>(size) { allocated_bytes += size * sizeof(Value); }
};

TEST(Pool, AllocatesTheComputedSize) {
  for (const std::size_t images : {1, 2, 3, 4, 5, 28, 1'000}) {
    const PoolSizes sizes = pool_sizes(images);
    allocated_bytes = 0;
    PoolBuffers<CountedBuffer>{sizes};
    EXPECT_EQ(allocated_bytes, sizes.bytes());
    EXPECT_LE(sizes.bytes(), kMinPoolBytes + images * kPoolImageBytes);
    EXPECT_GE(sizes.bytes() + sizeof(FaceBatch), kMinPoolBytes + images * kPoolImageBytes);
  }
}

TEST(Pool, HasCapacityForEveryBatch) {
  for (const std::size_t images : {1, 2, 7, 100}) {
    const PoolSizes sizes = pool_sizes(images);
    // If all images have equally many entries, as many images as fit are drawn.
    for (std::size_t listed = 1; listed <= kMaxEntries; ++listed) {
      const std::size_t drawn = std::min(images, sizes.faces / listed);
      const auto batches = static_cast<std::size_t>(FaceBatch::count_of(static_cast<int32_t>(listed)));
      ASSERT_LE(drawn * batches, sizes.batches()) << images << " images that list " << listed;
    }
  }
}

TEST(LargeBlocks, AllocateTheComputedSize) {
  const Scratch sizes{.blocks = 3, .max_faces = 7, .max_edges = 11};
  allocated_bytes = 0;
  OverflowBuffers<CountedBuffer>(sizes, 160);
  EXPECT_EQ(allocated_bytes, 3 * OverflowBuffers<CountedBuffer>::block_bytes(sizes, 160));
}

}  // namespace
}  // namespace pictura::cuda
