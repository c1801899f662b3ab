// The oracle (the CPU renderer) compared with the truth (the ray caster) in random scenes of each kind of
// bench/truth/random_scenes.h, for a few seeds. `pictura bench quality --random 200` draws 200 scenes of each kind.
#include "pictura/bench/truth/random_scenes.h"

#include <gtest/gtest.h>

#include "pictura/bench/quality.h"
#include "pictura/bench/truth/tolerances.h"

namespace pictura {
namespace {

class RandomScenes : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(All, RandomScenes, testing::Range(0, kNumRandomKinds));

TEST_P(RandomScenes, AreWithinThePromisedError) {
  // The first seeds, and seeds that revealed a fault in one of the kinds.
  for (const uint64_t seed : {0, 1, 2, 3, 4, 7, 54, 104, 109, 118, 142, 189, 191, 197}) {
    const PooledError error = measure_random_scene(static_cast<RandomKind>(GetParam()), seed);
    EXPECT_GE(error.psnr_db(), kMinOraclePsnr_db) << kRandomKindNames[GetParam()] << ", seed " << seed;
    if (seed >= 5) continue;
    EXPECT_LE(error.max_error(), kWorstOracleError) << kRandomKindNames[GetParam()] << ", seed " << seed;
  }
}

}  // namespace
}  // namespace pictura
