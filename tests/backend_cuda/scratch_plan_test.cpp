// How the CUDA renderer divides a bound on its memory.
#include "pictura/backend_cuda/scratch_plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/tests/support/error_message.h"

namespace pictura::cuda {
namespace {

constexpr ScratchNeeds kNeeds{
    .large_blocks = 8, .large_block_bytes = 20'000'000, .views = 1'024, .view_bytes = 280'000};

TEST(ScratchPlan, GivesAllThatIsNeededWhereThereIsRoom) {
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

TEST(ScratchPlan, ABatchIsCutWhereItsViewsDoNotFit) {
  const std::size_t least = bytes_of({1, 1}, kNeeds);
  EXPECT_EQ(plan_scratch(kNeeds, least).views, 1u);
  EXPECT_EQ(plan_scratch(kNeeds, least + 700'000).views, 3u);
}

TEST(ScratchPlan, SaysHowMuchItNeedsAtLeast) {
  EXPECT_EQ(test::message_of([] { plan_scratch(kNeeds, 1000); }),
            "renderer cuda: max_scratch_bytes: expected at least 20280000, got 1000");
}

}  // namespace
}  // namespace pictura::cuda
