// The oracle (the CPU renderer) compared with the truth (the ray caster).
#include "pictura/bench/quality.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/bench/truth/tolerances.h"

namespace pictura {
namespace {

TEST(Quality, TownsAreWithinThePromisedError) {
  for (const uint64_t seed : {1, 2, 3}) {
    Snapshot town = make_synthetic_town(seed, 120);
    town.views.resize(4);
    const Quality quality =
        measure_quality(town.geometry, town.scene.batch(), town.views, {.rig = paper_rig(), .num_threads = 1});
    RecordProperty("psnr_db_seed_" + std::to_string(seed), fmt::format("{:.2f}", quality.oracle.psnr_db()));
    fmt::print("seed {}: {:.2f} dB, u8 {:.2f} dB, 2x2 samples {:.2f} dB, worst {:.1f}/255, {:.3f} % beyond 1/255\n",
               seed, quality.oracle.psnr_db(), quality.oracle_bytes.psnr_db(), quality.grid_2x2.psnr_db(),
               255 * quality.oracle.max_error(), 100 * quality.oracle.share_above(1.0 / 255));
    EXPECT_GE(quality.oracle.psnr_db(), kMinOraclePsnr_db);
    EXPECT_GE(quality.oracle.psnr_db(), quality.grid_2x2.psnr_db() + kOracleGain_db);
    EXPECT_LE(quality.oracle.max_error(), kWorstOracleError);
  }
}

TEST(Quality, OddSizesAndMixedRigsAreWithinThePromisedError) {
  Snapshot town = make_synthetic_town(5, 60);
  town.views.resize(2);
  RendererConfig config{.rig = paper_rig(97, 55), .num_threads = 1};
  config.rig.cameras.resize(2);
  config.rig.cameras[1] = paper_rig(33, 71).cameras[1];
  config.rig.cameras[1].pitch_rad = -0.2f;
  config.rig.cameras[1].roll_rad = 0.3f;
  EXPECT_GE(measure_quality(town.geometry, town.scene.batch(), town.views, config).oracle.psnr_db(), kMinOraclePsnr_db);
}

// Returns a bright wall across the view, 20 m ahead.
StaticGeometry bright_wall() {
  StaticGeometry geometry;
  WallFace wall;
  wall.a_m = {20, -60, -5};
  wall.b_m = {20, 60, -5};
  wall.height_m = 30;
  wall.color = {1, 1, 1};
  geometry.walls.push_back(wall);
  geometry.build_grids();
  return geometry;
}

Quality measure_boxes(const StaticGeometry& geometry, const std::vector<AgentBox>& boxes) {
  SceneOwner scene;
  scene.agents = boxes;
  scene.end_world(0);
  return measure_quality(geometry, scene.batch(), std::vector<View>{make_view({0, 0, 0}, 0)},
                         {.rig = paper_rig(), .num_threads = 1});
}

TEST(Quality, FacesOfACuboidDoNotLeakTheWallBehindThem) {
  for (int i = 0; i < 8; ++i) {
    const float turn = 0.1f + 0.37f * static_cast<float>(i);
    const Quality quality =
        measure_boxes(bright_wall(), {make_box(AgentClass::vehicle, {8, 0.3f, 0}, turn, {4, 1.9f, 1.3f})});
    EXPECT_LE(quality.oracle.max_error(), kSharedEdgeError) << turn;
  }
}

TEST(Quality, AgentsAcrossTheNearPlane) {
  // A vehicle next to the camera and partly behind it; its side face crosses the near plane.
  const Quality quality =
      measure_boxes(bright_wall(), {make_box(AgentClass::vehicle, {2.0f, 1.2f, 0}, 0.2f, {4.5f, 1.9f, 1.7f})});
  EXPECT_GE(quality.oracle.psnr_db(), kMinOraclePsnr_db);
}

TEST(Quality, AWallThroughTheImageAndCarsOnBothSides) {
  StaticGeometry geometry;
  WallFace wall;
  wall.a_m = {-20, 2, 0};
  wall.b_m = {90, -4, 0};
  wall.height_m = 2.5f;
  geometry.walls.push_back(wall);
  // A second wall on a slope, behind the cars to the left.
  wall.a_m = {15, 14, -1};
  wall.b_m = {60, 20, 4};
  geometry.walls.push_back(wall);
  geometry.build_grids();
  std::vector<AgentBox> boxes;
  for (int i = 0; i < 6; ++i) {
    const float x = 8 + 10 * static_cast<float>(i);
    boxes.push_back(make_box(AgentClass::vehicle, {x, 6.5f - 0.05f * x, 0}, 0.3f, {4.2f, 1.8f, 1.5f}));
    boxes.push_back(make_box(AgentClass::vehicle, {x + 4, -6.5f - 0.05f * x, 0}, -0.2f, {4.2f, 1.8f, 2.8f}));
  }
  EXPECT_GE(measure_boxes(geometry, boxes).oracle.psnr_db(), kMinOraclePsnr_db);
}

TEST(Quality, RoadsOnTwoLevels) {
  const Snapshot bridge = make_bridge();
  EXPECT_GE(measure_quality(bridge.geometry, bridge.scene.batch(), bridge.views, {.rig = paper_rig(), .num_threads = 1})
                .oracle.psnr_db(),
            kMinOraclePsnr_db);
}

}  // namespace
}  // namespace pictura
