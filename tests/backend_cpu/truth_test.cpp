// The oracle against the truth in what is not colour at a size: the planes, visibility, the floor on widths, and scenes
// that are easily drawn wrong.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "pictura/bench/quality.h"
#include "pictura/common/make_renderer.h"
#include "pictura/tests/support/tolerances.h"

namespace pictura {
namespace {

// A road that climbs by 12 %, with marks, a stop line, a bridge over it, walls along it, lights, and upright agents on
// it.
Snapshot hill() {
  Snapshot hill;
  auto road = [](float x, float y) { return Vec3{x, y, x < 10 ? 0.0f : 0.12f * (x - 10)}; };
  for (const float y : {-3.5f, 0.0f, 3.5f}) {
    add_polyline(&hill.geometry, {road(-20, y), road(10, y), road(40, y), road(80, y)}, 0.15f, StripKind::lane_mark);
  }
  for (const float y : {-7.0f, 7.0f}) {
    add_polyline(&hill.geometry, {road(-20, y), road(10, y), road(40, y), road(80, y)}, 0.2f, StripKind::road_edge);
  }
  add_polyline(&hill.geometry, {road(30, -7), road(30, 0)}, 0.4f, StripKind::stop_line);
  for (const float x : {44.0f, 48.0f}) {
    add_polyline(&hill.geometry, {{x, -40, 9.5f}, {x, 40, 9.5f}}, 0.2f, StripKind::road_edge);
  }
  for (int i = 0; i < 5; ++i) {
    WallFace wall;
    wall.a_m = road(12 + 12 * static_cast<float>(i), 11);
    wall.b_m = road(20 + 12 * static_cast<float>(i), 12);
    wall.height_m = 6;
    hill.geometry.walls.push_back(wall);
  }
  for (const float facing : {-1.0f, 1.0f}) {
    LightHead head;
    head.position_m = road(34, 8.5f * facing) + Vec3{0, 0, 5};
    head.facing = {facing, 0};
    head.signal = hill.geometry.num_signals++;
    hill.geometry.heads.push_back(head);
    hill.scene.light_states.push_back(LightState::red);
  }
  hill.geometry.build_grids();
  for (int i = 0; i < 7; ++i) {
    const float x = 7 + 9 * static_cast<float>(i), y = i % 2 ? 1.8f : -1.8f;
    hill.scene.agents.push_back(
        make_box(AgentClass::vehicle, road(x, y), 0.1f * static_cast<float>(i), {4.4f, 1.9f, 1.5f}));
    hill.scene.agents.push_back(make_box(AgentClass::pedestrian, road(x + 3, 8.5f), 0, {0.6f, 0.6f, 1.75f}));
    hill.scene.agents.push_back(make_box(AgentClass::cyclist, road(x + 2, -5.5f), 0, {1.8f, 0.6f, 1.7f}));
  }
  hill.scene.end_world(0);
  // Up the hill, down from it, and across it from the bridge.
  hill.views = {make_view(road(-6, -1.8f), 0.05f), make_view(road(60, 0), kPi), make_view({46, -12, 9.5f}, 1.8f)};
  return hill;
}

Quality quality_of(const Snapshot& snapshot, const Rig& rig, float line_floor_px = 0.35f) {
  return measure_quality(snapshot.geometry, snapshot.scene.batch(), snapshot.views,
                         {.rig = rig, .num_threads = 1, .line_floor_px = line_floor_px});
}

TEST(Truth, HillsAndBridges) {
  const Quality quality = quality_of(hill(), paper_rig());
  EXPECT_GE(quality.oracle.psnr_db(), kLeastOraclePsnr_db);
  EXPECT_GE(quality.worst_image_db, kLeastImagePsnr_db);
}

TEST(Truth, OddSizesDownToOnePixelAndEightCamerasOfEightSizes) {
  const Snapshot snapshot = hill();
  EXPECT_GE(quality_of(snapshot, paper_rig(97, 55)).oracle.psnr_db(), kLeastOraclePsnr_db);
  // Everything shares the one pixel.
  EXPECT_LE(quality_of(snapshot, paper_rig(1, 1)).oracle.max_error(), kWorstOracleError);
  Rig eight;
  const int widths[] = {96, 64, 33, 128, 17, 50, 80, 7}, heights[] = {54, 36, 71, 20, 90, 50, 31, 5};
  for (int i = 0; i < 8; ++i) {
    Camera camera = paper_rig(widths[i], heights[i]).cameras[static_cast<std::size_t>(i % 4)];
    camera.name = std::to_string(i);
    camera.pitch_rad = 0.05f * static_cast<float>(i - 4);
    camera.roll_rad = 0.04f * static_cast<float>(4 - i);
    eight.cameras.push_back(camera);
  }
  EXPECT_GE(quality_of(snapshot, eight).oracle.psnr_db(), kLeastOraclePsnr_db);
}

// The oracle's planes of one image.
struct Planes {
  std::vector<float> depth_m;
  std::vector<uint8_t> class_id;
  std::vector<uint16_t> instance_id;
};

Planes planes_of(const StaticGeometry& geometry, const SceneOwner& scene, const View& view, const Camera& camera) {
  const RendererConfig config{.rig = {{camera}}, .num_threads = 1};
  const auto renderer = make_renderer("cpu", config);
  renderer->upload(geometry);
  const auto pixels = static_cast<std::size_t>(camera.width_px * camera.height_px);
  Planes planes{std::vector<float>(pixels), std::vector<uint8_t>(pixels), std::vector<uint16_t>(pixels)};
  HostImages images(config.rig, 1);
  CameraImages out = images.camera(0);
  out.depth_m = planes.depth_m.data();
  out.class_id = planes.class_id.data();
  out.instance_id = planes.instance_id.data();
  const std::vector<CameraImages> cameras{out};
  renderer->render(scene.batch(), std::vector<View>{view}, {MemorySpace::host, PixelFormat::u8, 1, cameras});
  return planes;
}

// Pixels whose centres show another surface in the oracle than in the truth.
struct PlaneDifference {
  std::size_t pixels = 0, classes = 0, instances = 0, depths = 0;
};

PlaneDifference compare_planes(const Snapshot& snapshot, const Camera& camera) {
  PlaneDifference difference;
  for (const View& view : snapshot.views) {
    const Planes planes = planes_of(snapshot.geometry, snapshot.scene, view, camera);
    const TruthImage truth = trace_image(snapshot.geometry, snapshot.scene.batch(), view, camera,
                                         RendererConfig{}.line_floor_px, TruthSamples::center);
    for (std::size_t i = 0; i < planes.depth_m.size(); ++i) {
      ++difference.pixels;
      const bool same_class = planes.class_id[i] == truth.class_id[i];
      difference.classes += !same_class;
      difference.instances += planes.instance_id[i] != truth.instance_id[i];
      const bool same_depth = planes.depth_m[i] == truth.depth_m[i] ||
                              std::abs(planes.depth_m[i] - truth.depth_m[i]) <= kDepthError * truth.depth_m[i];
      difference.depths += same_class && !same_depth;
    }
  }
  return difference;
}

TEST(Truth, PlanesTellOfTheSameSurfaces) {
  SyntheticTown town = make_synthetic_town(11, 120);
  town.views.resize(6);
  const Snapshot scenes[] = {{town.geometry, town.scene, town.views}, hill()};
  for (const Snapshot& scene : scenes) {
    const PlaneDifference difference = compare_planes(scene, paper_rig(192, 108).cameras[0]);
    const double allowed = kPlaneShare * static_cast<double>(difference.pixels);
    EXPECT_LE(static_cast<double>(difference.classes), allowed);
    EXPECT_LE(static_cast<double>(difference.instances), allowed);
    EXPECT_LE(static_cast<double>(difference.depths), allowed);
  }
}

TEST(Truth, NoSolidIsInFrontOfTheWrongOne) {
  // Disjoint footprints: at every centre of a pixel that is not at an edge, the solid that the truth sees.
  for (const uint64_t seed : {21, 22, 23}) {
    SyntheticTown town = make_synthetic_town(seed, 150);
    town.geometry.strips.clear();
    town.geometry.build_grids();
    town.views.resize(12);
    const PlaneDifference difference =
        compare_planes({town.geometry, town.scene, town.views}, paper_rig(192, 108).cameras[0]);
    // Rounding moves an edge over a centre once in a million pixels or so.
    EXPECT_LE(difference.instances, 1u) << seed;
    EXPECT_LE(difference.classes, 1u) << seed;
  }
}

TEST(Truth, BoxesThatIntersectShowWhereTheyDo) {
  // Cars that have driven into others, in front of a wall that one of them has driven into.
  Snapshot crash;
  crash.scene.agents = {make_box(AgentClass::vehicle, {11, 0.5f, 0}, 0.3f, {4.4f, 1.9f, 1.5f}),
                        make_box(AgentClass::vehicle, {13, -0.6f, 0}, 1.4f, {4.6f, 2.0f, 1.7f}),
                        make_box(AgentClass::cyclist, {8, 1.5f, 0}, 0.9f, {1.8f, 0.6f, 1.7f}),
                        make_box(AgentClass::vehicle, {9, 2.2f, 0}, -0.4f, {4.4f, 1.9f, 1.5f})};
  crash.scene.end_world(0);
  WallFace wall;
  wall.a_m = {10, 3, 0};
  wall.b_m = {16, -9, 0};
  wall.height_m = 3;
  crash.geometry.walls.push_back(wall);
  crash.geometry.build_grids();
  crash.views = {make_view({}, 0), make_view({22, 5, 0}, 3.6f)};
  const Quality quality = quality_of(crash, paper_rig());
  EXPECT_LE(quality.oracle.max_error(), kWorstOracleError);
  const PlaneDifference difference = compare_planes(crash, paper_rig(192, 108).cameras[0]);
  EXPECT_LE(static_cast<double>(difference.instances), kPlaneShare * static_cast<double>(difference.pixels));
}

TEST(Truth, VisibilityAgrees) {
  SyntheticTown town = make_synthetic_town(13, 120);
  town.views.resize(2);
  Snapshot slope = hill();
  const Snapshot scenes[] = {{town.geometry, town.scene, town.views}, slope};
  int compared = 0, partly = 0;
  for (const Snapshot& scene : scenes) {
    const RendererConfig config{.rig = paper_rig(), .num_threads = 1};
    const auto renderer = make_renderer("cpu", config);
    renderer->upload(scene.geometry);
    for (std::size_t v = 0; v < scene.views.size(); ++v) {
      std::vector<VisibilityQuery> queries;
      for (std::size_t agent = 0; agent < scene.scene.agents.size(); agent += 3) {
        queries.push_back({static_cast<int32_t>(v), static_cast<int32_t>(agent)});
      }
      std::vector<float> visibility(queries.size());
      renderer->visibility(scene.scene.batch(), scene.views, queries, visibility);
      for (std::size_t q = 0; q < queries.size(); ++q) {
        if (std::isnan(visibility[q])) continue;
        const TruthVisibility truth = trace_visibility(scene.geometry, scene.scene.batch(), scene.views[v], config.rig,
                                                       config.line_floor_px, queries[q].agent);
        if (truth.alone_px < 4) continue;
        ++compared;
        partly += truth.share > 0.05 && truth.share < 0.95;
        EXPECT_NEAR(visibility[q], truth.share, kVisibilityError) << "view " << v << " agent " << queries[q].agent;
      }
    }
  }
  EXPECT_GT(compared, 20);
  EXPECT_GT(partly, 5);
}

// An image drawn `factor` times larger, averaged down.
std::vector<float> drawn_down(const Snapshot& snapshot, Camera camera, int factor, float line_floor_px) {
  const int width = camera.width_px, height = camera.height_px;
  camera.width_px *= factor;
  camera.height_px *= factor;
  const auto scale = static_cast<float>(factor);
  camera.focal_x_px *= scale;
  camera.focal_y_px *= scale;
  camera.center_x_px *= scale;
  camera.center_y_px *= scale;
  const RendererConfig config{.rig = {{camera}}, .num_threads = 1, .line_floor_px = line_floor_px};
  const auto renderer = make_renderer("cpu", config);
  renderer->upload(snapshot.geometry);
  HostImages images(config.rig, 1, PixelFormat::f32);
  renderer->render(snapshot.scene.batch(), snapshot.views, images.batch());
  const auto* large = static_cast<const float*>(images.camera(0).data);
  std::vector<float> small(static_cast<std::size_t>(3 * width * height));
  for (int channel = 0; channel < 3; ++channel) {
    for (int y = 0; y < camera.height_px; ++y) {
      for (int x = 0; x < camera.width_px; ++x) {
        small[static_cast<std::size_t>((channel * height + y / factor) * width + x / factor)] +=
            large[static_cast<std::size_t>((channel * camera.height_px + y) * camera.width_px + x)] / (scale * scale);
      }
    }
  }
  return small;
}

TEST(Truth, WithoutAFloorALargerImageAveragedDownIsTheSmallOne) {
  Snapshot snapshot = hill();
  snapshot.views.resize(1);
  const Camera camera = paper_rig().cameras[0];
  const TruthImage bare = trace_image(snapshot.geometry, snapshot.scene.batch(), snapshot.views[0], camera, 0);
  const std::vector<float> small = drawn_down(snapshot, camera, 1, 0), large = drawn_down(snapshot, camera, 16, 0);
  EXPECT_GE(PooledError(small, bare.rgb).psnr_db(), kLeastOraclePsnr_db);
  EXPECT_GE(PooledError(large, bare.rgb).psnr_db(), kLeastOraclePsnr_db);
  EXPECT_GE(PooledError(large, small).psnr_db(), kLeastOraclePsnr_db);
  // The floor is of pixels of the image, so it is another one at another size.
  EXPECT_LT(PooledError(drawn_down(snapshot, camera, 16, 0.35f), drawn_down(snapshot, camera, 1, 0.35f)).psnr_db(), 45);
}

}  // namespace
}  // namespace pictura
