// The oracle against the truth in random scenes of each kind of bench/truth/random_scenes.h. A few seeds of each: two
// hundred are drawn by `pictura bench quality --random 200`.
#include "pictura/bench/truth/random_scenes.h"

#include <gtest/gtest.h>

#include "pictura/bench/quality.h"
#include "pictura/bench/truth/tolerances.h"

namespace pictura {
namespace {

class RandomScenes : public testing::TestWithParam<RandomKind> {};
INSTANTIATE_TEST_SUITE_P(All, RandomScenes,
                         testing::Values(RandomKind::near_plane, RandomKind::bridge_from_below,
                                         RandomKind::crashed_boxes, RandomKind::level_edges));

TEST_P(RandomScenes, AreWithinThePromisedError) {
  for (uint64_t seed = 0; seed < 6; ++seed) {
    EXPECT_GE(measure_random_scene(GetParam(), seed).psnr_db(), kMinOraclePsnr_db) << "seed " << seed;
  }
}

}  // namespace
}  // namespace pictura
