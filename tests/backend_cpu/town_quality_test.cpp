// The oracle (the CPU renderer) compared with the truth (the ray caster) on whole maps: CARLA's towns, with their hills
// and bridges, and procedural towns. Scenes have moving agents of all classes, walls and lights.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "pictura/bench/quality.h"
#include "pictura/bench/truth/tolerances.h"
#include "pictura/tests/support/named_maps.h"

namespace pictura {
namespace {

class TownQuality : public testing::TestWithParam<const char*> {};

TEST_P(TownQuality, IsWithinThePromisedError) {
  const std::string map = GetParam();
  if (const std::string why = test::missing(map); !why.empty()) GTEST_SKIP() << why;
  const Snapshot snapshot = drive_snapshot({.map = map, .views = 8});
  const Quality quality =
      measure_quality(snapshot.geometry, snapshot.scene.batch(), snapshot.views, {.rig = paper_rig()});
  fmt::print(
      "{}: {:.2f} dB over {} images, worst image {:.2f} dB, worst value {:.1f}/255; 2x2 samples {:.2f} dB; {:.3f} % "
      "beyond 1/255\n",
      map, quality.oracle.psnr_db(), quality.images, quality.worst_image_db, 255 * quality.oracle.max_error(),
      quality.grid_2x2.psnr_db(), 100 * quality.oracle.share_above(1.0 / 255));
  EXPECT_GE(quality.images, 20);
  EXPECT_GE(quality.oracle.psnr_db(), kMinOraclePsnr_db);
  EXPECT_GE(quality.worst_image_db, kMinImagePsnr_db);
  EXPECT_GE(quality.oracle.psnr_db(), quality.grid_2x2.psnr_db() + kOracleGain_db);
}

INSTANTIATE_TEST_SUITE_P(Maps, TownQuality,
                         testing::Values("Town01", "Town02", "Town03", "Town04", "Town05", "Town06", "Town07",
                                         "Town10HD", "procedural:1", "procedural:2"),
                         test::map_name);

}  // namespace
}  // namespace pictura
