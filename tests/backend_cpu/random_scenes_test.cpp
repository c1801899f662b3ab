// The oracle against the truth in random scenes of each kind of bench/truth/random_scenes.h. A few seeds of each: two
// hundred are drawn by `pictura bench quality --random 200`.
#include "pictura/bench/truth/random_scenes.h"

#include <gtest/gtest.h>

#include "pictura/bench/quality.h"
#include "pictura/bench/truth/tolerances.h"

namespace pictura {
namespace {

class RandomScenes : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(All, RandomScenes, testing::Range(0, kNumRandomKinds));

TEST_P(RandomScenes, AreWithinThePromisedError) {
  for (uint64_t seed = 0; seed < 5; ++seed) {
    const PooledError error = measure_random_scene(static_cast<RandomKind>(GetParam()), seed);
    EXPECT_GE(error.psnr_db(), kMinOraclePsnr_db) << kRandomKindNames[GetParam()] << ", seed " << seed;
    EXPECT_LE(error.max_error(), kWorstOracleError) << kRandomKindNames[GetParam()] << ", seed " << seed;
  }
}

}  // namespace
}  // namespace pictura
