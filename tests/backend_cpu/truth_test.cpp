// The oracle (the CPU renderer) compared with the truth (the ray caster) in everything except colours of towns: planes,
// visibility, the minimum width of lines, and difficult scenes.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "pictura/backends/make_renderer.h"
#include "pictura/bench/quality.h"
#include "pictura/bench/truth/tolerances.h"

namespace pictura {
namespace {

Quality quality_of(const Snapshot& town, const Rig& rig, float line_floor_px = 0.35f) {
  return measure_quality(town.geometry, town.scene.batch(), town.views,
                         {.rig = rig, .num_threads = 1, .line_floor_px = line_floor_px});
}

TEST(Truth, HillsAndBridges) {
  const Quality quality = quality_of(make_hill(), paper_rig());
  EXPECT_GE(quality.oracle.psnr_db(), kMinOraclePsnr_db);
  EXPECT_GE(quality.worst_image_db, kMinImagePsnr_db);
}

TEST(Truth, OddSizesAndEightCamerasOfEightSizes) {
  const Snapshot town = make_hill();
  EXPECT_GE(quality_of(town, paper_rig(97, 55)).oracle.psnr_db(), kMinOraclePsnr_db);
  // All objects share the single pixel.
  EXPECT_LE(quality_of(town, paper_rig(1, 1)).oracle.max_error(), kWorstOracleError);
  EXPECT_GE(quality_of(town, eight_camera_rig()).oracle.psnr_db(), kMinOraclePsnr_db);
}

// The oracle's planes of one image.
struct TruePlanes {
  std::vector<float> depth_m;
  std::vector<uint8_t> class_id;
  std::vector<uint16_t> instance_id;
};

TruePlanes planes_of(const StaticGeometry& geometry, const SceneOwner& scene, const View& view, const Camera& camera) {
  const RendererConfig config{.rig = {{camera}}, .num_threads = 1};
  const auto renderer = make_renderer("cpu", config);
  renderer->upload(0, geometry);
  const auto pixels = static_cast<std::size_t>(camera.width_px * camera.height_px);
  TruePlanes planes{std::vector<float>(pixels), std::vector<uint8_t>(pixels), std::vector<uint16_t>(pixels)};
  HostImages images(config.rig, 1);
  CameraImages out = images.camera(0);
  out.depth_m = planes.depth_m.data();
  out.class_id = planes.class_id.data();
  out.instance_id = planes.instance_id.data();
  const std::vector<CameraImages> cameras{out};
  renderer->render(scene.batch(), std::vector<View>{view}, {Device{}, PixelFormat::u8, 1, cameras});
  return planes;
}

// Counts of pixels whose centres show another surface in the oracle than in the truth.
struct PlaneDifference {
  std::size_t pixels = 0, classes = 0, instances = 0, depths = 0;
};

PlaneDifference compare_planes(const Snapshot& town, const Camera& camera) {
  PlaneDifference difference;
  for (const View& view : town.views) {
    const TruePlanes planes = planes_of(town.geometry, town.scene, view, camera);
    const TruthImage truth = trace_image(town.geometry, town.scene.batch(), view, camera,
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

TEST(Truth, PlanesShowTheSameSurfaces) {
  Snapshot town = make_synthetic_town(11, 120);
  town.views.resize(6);
  const Snapshot scenes[] = {town, make_hill()};
  for (const Snapshot& scene : scenes) {
    const PlaneDifference difference = compare_planes(scene, paper_rig(192, 108).cameras[0]);
    const double allowed = kPlaneShare * static_cast<double>(difference.pixels);
    EXPECT_LE(static_cast<double>(difference.classes), allowed);
    EXPECT_LE(static_cast<double>(difference.instances), allowed);
    EXPECT_LE(static_cast<double>(difference.depths), allowed);
  }
}

TEST(Truth, SolidsAreInDepthOrder) {
  // Footprints are disjoint: every pixel centre that is not on an edge must show the truth's solid.
  for (const uint64_t seed : {21, 22, 23}) {
    Snapshot town = make_synthetic_town(seed, 150);
    town.geometry.strips.clear();
    town.geometry.build_grids();
    town.views.resize(12);
    const PlaneDifference difference = compare_planes(town, paper_rig(192, 108).cameras[0]);
    // Rounding moves an edge over a centre about once in a million pixels.
    EXPECT_LE(difference.instances, 1u) << seed;
    EXPECT_LE(difference.classes, 1u) << seed;
  }
}

TEST(Truth, IntersectingBoxesAreDividedWhereTheyMeet) {
  const Snapshot crash = make_crash();
  const Quality quality = quality_of(crash, paper_rig());
  EXPECT_LE(quality.oracle.max_error(), kWorstOracleError);
  const PlaneDifference difference = compare_planes(crash, paper_rig(192, 108).cameras[0]);
  EXPECT_LE(static_cast<double>(difference.instances), kPlaneShare * static_cast<double>(difference.pixels));
}

TEST(Truth, VisibilityMatchesTheTruth) {
  Snapshot town = make_synthetic_town(13, 120);
  town.views.resize(2);
  const Snapshot scenes[] = {town, make_hill()};
  int compared = 0, partly = 0;
  for (const Snapshot& scene : scenes) {
    const RendererConfig config{.rig = paper_rig(), .num_threads = 1};
    const auto renderer = make_renderer("cpu", config);
    renderer->upload(0, scene.geometry);
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

// Returns an image drawn `factor` times larger, averaged down.
std::vector<float> drawn_down(const Snapshot& town, Camera camera, int factor, float line_floor_px) {
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
  renderer->upload(0, town.geometry);
  HostImages images(config.rig, 1, PixelFormat::f32);
  renderer->render(town.scene.batch(), town.views, images.batch());
  const auto* large = static_cast<const float*>(images.camera(0).data);
  std::vector<float> small(static_cast<std::size_t>(3 * width * height));
  for (int channel = 0; channel < 3; ++channel) {
    for (int y = 0; y < camera.height_px; ++y) {
      for (int x = 0; x < camera.width_px; ++x) {
        small[(channel * height + y / factor) * width + x / factor] +=
            large[(channel * camera.height_px + y) * camera.width_px + x] / (scale * scale);
      }
    }
  }
  return small;
}

TEST(Truth, WithoutALineFloorAveragedLargeImagesEqualSmallOnes) {
  Snapshot town = make_hill();
  town.views.resize(1);
  const Camera camera = paper_rig().cameras[0];
  const TruthImage bare = trace_image(town.geometry, town.scene.batch(), town.views[0], camera, 0);
  const std::vector<float> small = drawn_down(town, camera, 1, 0), large = drawn_down(town, camera, 16, 0);
  EXPECT_GE(PooledError(small, bare.rgb).psnr_db(), kMinOraclePsnr_db);
  EXPECT_GE(PooledError(large, bare.rgb).psnr_db(), kMinOraclePsnr_db);
  EXPECT_GE(PooledError(large, small).psnr_db(), kMinOraclePsnr_db);
  // The floor is in pixels, so it differs between sizes.
  EXPECT_LT(PooledError(drawn_down(town, camera, 16, 0.35f), drawn_down(town, camera, 1, 0.35f)).psnr_db(), 45);
}

}  // namespace
}  // namespace pictura
