// The OpenGL renderer compared with the oracle (the CPU renderer), within tolerances that depend on the number of
// samples; and the interface of the OpenGL renderer.
#include <algorithm>
#include <functional>
#include <thread>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/bench/truth/image_truth.h"
#include "pictura/bench/truth/tolerances.h"
#include "pictura/tests/backend_gl/gl_support.h"
#include "pictura/tests/support/keyed_views.h"
#include "pictura/tests/support/renderer_interface.h"

namespace pictura {
namespace {

using testing::HasSubstr;

class GlRenderer : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    const std::string why = missing(GetParam());
    if (!why.empty()) GTEST_SKIP() << why;
  }
};
INSTANTIATE_TEST_SUITE_P(Contexts, GlRenderer, testing::Values("gl:osmesa", "gl:egl"),
                         [](const auto& name) { return std::string(name.param).substr(3); });

struct SampledQuality {
  PixelSamples samples;
  double min_psnr_db;
};
constexpr SampledQuality kQualities[] = {{{.grid = 1}, kMinGlPsnr1_db},
                                         {{.multisample = 4}, kMinGlPsnrMsaa4_db},
                                         {{.grid = 2}, kMinGlPsnr2x2_db},
                                         {{.grid = 4}, kMinGlPsnr4x4_db},
                                         {{.grid = 8}, kMinGlPsnr8x8_db}};

Snapshot town_of(uint64_t seed, int num_views) {
  Snapshot town = make_synthetic_town(seed, 120);
  town.views.resize(num_views);
  return town;
}

TEST_P(GlRenderer, MatchesTheOracle) {
  for (const uint64_t seed : {1, 2, 3}) {
    const Snapshot town = town_of(seed, 8);
    RendererConfig config{.num_threads = 1};
    const std::vector<float> oracle = draw("cpu", town.geometry, town.scene, town.views, config);
    for (const SampledQuality& quality : kQualities) {
      config.samples = quality.samples;
      const double measured_db =
          PooledError(draw(GetParam(), town.geometry, town.scene, town.views, config), oracle).psnr_db();
      fmt::print("seed {}, {}x{} grid, {} samples: {:.2f} dB\n", seed, quality.samples.grid, quality.samples.grid,
                 quality.samples.multisample, measured_db);
      EXPECT_GE(measured_db, quality.min_psnr_db);
    }
  }
}

TEST_P(GlRenderer, MountsRandomizedCamerasAsTheOracleDoes) {
  Snapshot town = town_of(2, 8);
  town.views = test::keyed(town.views);
  RendererConfig config{.num_threads = 1, .randomization = {.rotation_deg = 6, .shift_m = 0.2, .focal_share = 0.2}};
  const std::vector<float> oracle = draw("cpu", town.geometry, town.scene, town.views, config);
  config.samples.grid = 4;
  EXPECT_GE(PooledError(draw(GetParam(), town.geometry, town.scene, town.views, config), oracle).psnr_db(),
            kMinGlPsnr4x4_db);
}

TEST_P(GlRenderer, TolerancesDetectFaults) {
  const Snapshot town = town_of(1, 8);
  const RendererConfig config{.num_threads = 1};
  const std::vector<float> oracle = draw("cpu", town.geometry, town.scene, town.views, config);
  RendererConfig shifted = config, without_floor = config, tinted = config;
  for (Camera& camera : shifted.rig.cameras) camera.center_x_px += 0.5f;
  without_floor.line_floor_px = 0;
  tinted.debug_palette = true;
  SceneOwner halted = town.scene;
  for (AgentBox& box : halted.agents) box.palette = 1;
  StaticGeometry edges_on_top = town.geometry;
  for (Strip& strip : edges_on_top.strips) {
    if (strip.kind == StripKind::road_edge) strip.kind = StripKind::stop_line;
  }
  for (const SampledQuality& quality : kQualities) {
    auto sampled_db = [&](const StaticGeometry& geometry, const SceneOwner& scene, RendererConfig with_fault) {
      with_fault.samples = quality.samples;
      return PooledError(draw(GetParam(), geometry, scene, town.views, with_fault), oracle).psnr_db();
    };
    EXPECT_LT(sampled_db(town.geometry, town.scene, shifted), quality.min_psnr_db);
    EXPECT_LT(sampled_db(town.geometry, halted, tinted), quality.min_psnr_db);
    // With few samples, errors of thin lines are below the noise.
    if (quality.min_psnr_db < kMinGlPsnr2x2_db) continue;
    EXPECT_LT(sampled_db(town.geometry, town.scene, without_floor), quality.min_psnr_db);
    if (quality.min_psnr_db < kMinGlPsnr8x8_db) continue;
    EXPECT_LT(sampled_db(edges_on_top, town.scene, config), quality.min_psnr_db);
  }
}

TEST_P(GlRenderer, AnySizeAndMixedRigs) {
  const Snapshot town = town_of(5, 3);
  RendererConfig config{.rig = paper_rig(97, 55), .num_threads = 1};
  config.rig.cameras[1] = paper_rig(33, 71).cameras[1];
  config.rig.cameras[1].pitch_rad = -0.2f;
  config.rig.cameras[1].roll_rad = 0.3f;
  config.rig.cameras[2] = paper_rig(1, 1).cameras[2];
  config.rig.cameras[3].focal_x_px *= 0.5f;  // the first camera's size with another projection
  config.rig.cameras[3].center_y_px += 7.25f;
  config.samples.grid = 8;
  RendererConfig exact = config;
  exact.samples = {};
  EXPECT_GE(PooledError(draw(GetParam(), town.geometry, town.scene, town.views, config),
                        draw("cpu", town.geometry, town.scene, town.views, exact))
                .psnr_db(),
            kMinGlPsnr8x8_db);
}

TEST_P(GlRenderer, RoadsOnTwoLevels) {
  const Snapshot bridge = make_bridge();
  RendererConfig config{.num_threads = 1};
  const std::vector<float> oracle = draw("cpu", bridge.geometry, bridge.scene, bridge.views, config);
  config.samples.grid = 8;
  EXPECT_GE(PooledError(draw(GetParam(), bridge.geometry, bridge.scene, bridge.views, config), oracle).psnr_db(),
            kMinGlPsnr8x8_db);
}

TEST_P(GlRenderer, BoxesPartlyBelowARoadAreInFrontOfItsStrips) {
  // Upright boxes dip into roads on slopes. The strip under the car extends towards the camera.
  StaticGeometry geometry;
  add_polyline(&geometry, {{2, 0.3f, 0}, {12, 0.3f, 0}}, 0.8f, StripKind::lane_mark);
  geometry.build_grids();
  SceneOwner scene;
  scene.agents = {make_box(AgentClass::vehicle, {9, 0, -0.4f}, 0, {4, 2, 1.5f})};
  scene.end_world(0);
  RendererConfig config{.rig = simple_rig(), .num_threads = 1};
  const std::vector<float> oracle = draw("cpu", geometry, scene, {make_view({}, 0)}, config);
  config.samples.grid = 8;
  EXPECT_GE(PooledError(draw(GetParam(), geometry, scene, {make_view({}, 0)}, config), oracle).psnr_db(),
            kMinGlPsnr8x8_db);
}

// Returns the number of pixels of a patch of road that do not show the topmost strip. The first `count` of five strips
// cover the patch, 2 to 10 m ahead at height z. The image shows `others` further strips elsewhere.
int wrong_pixels(const std::string& backend, int count, float z, int others) {
  const StripKind kinds[] = {StripKind::road_edge, StripKind::lane_mark, StripKind::lane_mark, StripKind::crosswalk,
                             StripKind::stop_line};
  const Rgb colors[] = {kRoadEdgeColor, kWhiteMarkColor, kYellowMarkColor, kCrosswalkColor, kStopLineColor};
  const Rgb on_top[] = {kRoadEdgeColor, kWhiteMarkColor, kWhiteMarkColor, kCrosswalkColor, kStopLineColor};
  StaticGeometry geometry;
  for (int i = 0; i < count; ++i) {
    const float at = static_cast<float>(i);
    append_strips(std::vector<Vec3>{{2 - 0.3f * at, 0.07f * at, z}, {10 + 0.5f * at, -0.04f * at, z}}, 3, colors[i],
                  kinds[i], &geometry.strips);
  }
  for (int i = 0; i < others; ++i) add_polyline(&geometry, {{20, 10, z}, {24, 10, z}}, 0.2f, StripKind::lane_mark);
  geometry.build_grids();
  SceneOwner scene;
  scene.end_world(0);
  const std::vector<float> image =
      draw(backend, geometry, scene, {make_view({}, 0.01f)}, {.rig = simple_rig(), .num_threads = 1});
  const Rgb& top = on_top[count - 1];
  int wrong = 0;
  const int first_row = z < simple_rig().cameras[0].position_m.z ? 60 : 30;
  for (int y = first_row; y < first_row + 10; ++y) {
    for (int x = 45; x < 55; ++x) {
      const auto pixel = static_cast<std::size_t>(100 * y + x);
      const float r = image[pixel], g = image[pixel + 10000], b = image[pixel + 20000];
      // Colours are compared by hue, because pieces fade with distance.
      wrong += r == 0 || std::abs(r * top.g - g * top.r) > 1e-3f || std::abs(b * top.g - g * top.b) > 1e-3f;
    }
  }
  return wrong;
}

TEST_P(GlRenderer, StripsOfOneLevelAreOrderedByKindThenIndex) {
  // Strips are at heights with different rounding, the last two above the camera. The more strips an image shows, the
  // smaller their depth offsets.
  for (const int others : {0, 2000}) {
    for (const float z : {0.0f, 0.1f, -0.3f, 1.0f / 3, 3.0f, 3.1f}) {
      for (int count = 1; count <= 5; ++count) {
        EXPECT_EQ(wrong_pixels(GetParam(), count, z, others), 0) << count << " strips and " << others << " at " << z;
      }
    }
  }
}

TEST_P(GlRenderer, BatchesLargerThanATextureArrayGiveTheSameImages) {
  // More images of one size than OpenGL's guaranteed layers (2048), in two cameras: arrays end within a camera's views.
  const Snapshot town = town_of(3, 16);
  RendererConfig config{.rig = paper_rig(3, 2), .num_threads = 1};
  config.rig.cameras.resize(2);
  const std::vector<float> once = draw(GetParam(), town.geometry, town.scene, town.views, config);
  std::vector<View> many;
  constexpr std::size_t kTimes = 150;
  for (std::size_t i = 0; i < kTimes; ++i) many.insert(many.end(), town.views.begin(), town.views.end());
  const std::vector<float> images = draw(GetParam(), town.geometry, town.scene, many, config);
  ASSERT_EQ(images.size(), kTimes * once.size());
  for (std::size_t i = 0; i < kTimes; ++i) {
    ASSERT_TRUE(std::equal(once.begin(), once.end(), images.begin() + static_cast<std::ptrdiff_t>(i * once.size())))
        << "repeat " << i;
  }
}

TEST_P(GlRenderer, ImagesLargerThanTheInvocationLimitAreComplete) {
  StaticGeometry geometry;
  geometry.walls.push_back({{20, -60, -30}, {20, 60, -30}, 60});
  geometry.build_grids();
  const RendererConfig config{.rig = front_rig(2049, 2048), .num_threads = 1};
  ASSERT_GT(2049 * 2048, 65535 * 64);
  SceneOwner scene;
  scene.end_world(0);
  const std::vector<float> image = draw(GetParam(), geometry, scene, {make_view({}, 0)}, config);
  const std::size_t pixels = image.size() / 3;
  for (std::size_t channel = 0; channel < 3; ++channel) {
    const auto first = image.begin() + static_cast<std::ptrdiff_t>(channel * pixels);
    EXPECT_GT(*first, 0.2f);
    EXPECT_EQ(std::count(first, first + static_cast<std::ptrdiff_t>(pixels), *first),
              static_cast<std::ptrdiff_t>(pixels));
  }
}

std::vector<uint8_t> draw_bytes(Renderer* renderer, const Snapshot& town, const std::vector<View>& views) {
  HostImages images(renderer->config().rig, static_cast<int>(views.size()));
  renderer->render(town.scene.batch(), views, images.batch());
  return {images.bytes().begin(), images.bytes().end()};
}

TEST_P(GlRenderer, BytesAreTheRoundedColors) {
  const Snapshot town = town_of(4, 4);
  for (const PixelSamples samples : {PixelSamples{.grid = 1}, PixelSamples{.grid = 3}}) {
    const RendererConfig config{.rig = paper_rig(97, 55), .num_threads = 1, .samples = samples};
    const std::vector<float> colors = draw(GetParam(), town.geometry, town.scene, town.views, config);
    const auto renderer = make_renderer(GetParam(), config);
    renderer->upload(0, town.geometry);
    const std::vector<uint8_t> bytes = draw_bytes(renderer.get(), town, town.views);
    ASSERT_EQ(bytes.size(), colors.size());
    // Samples are rounded before averaging, and the mean is rounded afterwards; drivers round to within 0.6 of a step.
    const float most = samples.grid > 1 ? 1.1f : 0.6f;
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      ASSERT_NEAR(bytes[i], 255 * colors[i], most + 1e-3f) << "value " << i;
    }
  }
}

TEST_P(GlRenderer, RenderersAreIndependent) {
  const Snapshot town = town_of(1, 6), other_town = town_of(2, 6);
  auto alone = [](const std::string& backend, const Snapshot& shown, PixelSamples samples) {
    const auto renderer = make_renderer(backend, {.num_threads = 1, .samples = samples});
    renderer->upload(0, shown.geometry);
    return draw_bytes(renderer.get(), shown, shown.views);
  };
  const auto expected = alone(GetParam(), town, {}), expected_other = alone(GetParam(), other_town, {.grid = 2});
  const auto first = make_renderer(GetParam(), {.num_threads = 1});
  const auto second = make_renderer(GetParam(), {.num_threads = 1, .samples = {.grid = 2}});
  // A renderer of another library, if it is installed.
  const std::string other = std::string(GetParam()) == "gl:egl" ? "gl:osmesa" : "gl:egl";
  const auto third = missing(other).empty() ? make_renderer(other, {.num_threads = 1}) : nullptr;
  first->upload(0, town.geometry);
  second->upload(0, other_town.geometry);
  if (third) third->upload(0, other_town.geometry);
  for (int repeat = 0; repeat < 3; ++repeat) {
    EXPECT_EQ(draw_bytes(first.get(), town, town.views), expected);
    if (third) draw_bytes(third.get(), other_town, other_town.views);
    EXPECT_EQ(draw_bytes(second.get(), other_town, other_town.views), expected_other);
  }
}

TEST_P(GlRenderer, CanBeUsedByOneThreadAfterAnother) {
  const Snapshot town = town_of(1, 4);
  const auto renderer = make_renderer(GetParam(), {.num_threads = 1});
  renderer->upload(0, town.geometry);
  const std::vector<uint8_t> here = draw_bytes(renderer.get(), town, town.views);
  std::vector<uint8_t> there;
  std::thread([&] { there = draw_bytes(renderer.get(), town, town.views); }).join();
  EXPECT_EQ(there, here);
  // A smaller batch, and then the first batch again, in memory that has grown.
  const std::vector<View> fewer(town.views.begin(), town.views.begin() + 1);
  const std::vector<uint8_t> first = draw_bytes(renderer.get(), town, fewer);
  EXPECT_TRUE(std::equal(first.begin(), first.end(), here.begin()));
  EXPECT_EQ(draw_bytes(renderer.get(), town, town.views), here);
  EXPECT_TRUE(draw_bytes(renderer.get(), town, {}).empty());
}

test::MakeForRig maker(const std::string& backend) {
  return [backend](const Rig& rig) { return make_renderer(backend, {.rig = rig, .num_threads = 1}); };
}

TEST_P(GlRenderer, KeepsMapsByHandle) {
  test::expect_maps_by_handle(maker(GetParam()));
  test::expect_refused_handles(maker(GetParam()));
  test::expect_refused_order(maker(GetParam()));
}

TEST_P(GlRenderer, DrawsTheCountedViews) { test::expect_counted_views(maker(GetParam())); }

void expect_error(const std::function<void()>& call, const std::string& part) {
  try {
    call();
    ADD_FAILURE() << "expected an Error with: " << part;
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr(part));
  }
}

TEST_P(GlRenderer, ErrorsNameUnsupportedFeatures) {
  const std::string name = GetParam();
  const Snapshot town = town_of(1, 1);
  const auto renderer = make_renderer(name, {.num_threads = 1});
  renderer->upload(0, town.geometry);
  HostImages images(renderer->config().rig, 1);
  std::vector<CameraImages> cameras(images.batch().cameras.begin(), images.batch().cameras.end());
  std::vector<float> depth(96 * 54);
  cameras[2].depth_m = depth.data();
  ImageBatch with_depth = images.batch();
  with_depth.cameras = cameras;
  expect_error([&] { renderer->render(town.scene.batch(), town.views, with_depth); },
               "renderer " + name + ": images: camera 2: only cpu and cuda support depth, class and instance planes");
  float visibility = 0;
  expect_error(
      [&] {
        const VisibilityQuery query;
        renderer->visibility(town.scene.batch(), town.views, Span<const VisibilityQuery>(&query, 1),
                             Span<float>(&visibility, 1));
      },
      "renderer " + name + ": only cpu and cuda support visibility");
  HostImages halves(renderer->config().rig, 1, PixelFormat::f16);
  expect_error([&] { renderer->render(town.scene.batch(), town.views, halves.batch()); }, "got f16");
  expect_error([&] { make_renderer(name, {.samples = {.multisample = 1024}}); },
               "this driver's limit for MSAA, got 1024");
  expect_error([&] { make_renderer(name, {.rig = paper_rig(8192, 8), .samples = {.grid = 16}}); },
               "samples along an axis, which is this driver's limit, got 131072");
  expect_error([&] { make_renderer(name, {.samples = {.grid = 0}}); }, "expected 1 sample or more");
  expect_error([&] { make_renderer(name, {.randomization = {.dropped_probability = 0.1}}); },
               "renderer " + name + ": only cpu and cuda support randomized brightness, noise and lost images");
}

TEST(GlNames, AnUnknownContextNameListsAllNames) {
  expect_error([] { make_renderer("gl:glx", {}); }, "gl, gl:egl, gl:osmesa");
}

TEST(GlNames, OtherBackendsRefuseSamples) {
  expect_error([] { make_renderer("cpu", {.samples = {.grid = 4}}); },
               "renderer cpu: samples: only gl supports samples");
}

TEST(GlNames, GlReportsItsContext) {
  if (!missing("gl:osmesa").empty() && !missing("gl:egl").empty()) GTEST_SKIP() << "neither OSMesa nor EGL";
  std::string choice;
  const auto renderer = make_renderer("gl", {}, &choice);
  EXPECT_EQ(choice.substr(0, choice.find(": ")), renderer->name());
  EXPECT_EQ(renderer->name(), missing("gl:egl").empty() ? "gl:egl" : "gl:osmesa");
}

TEST(GlNames, OsmesaDrawsOnlyInHostMemory) {
  expect_error([] { make_renderer("gl:osmesa", {.device = {MemorySpace::cuda, 0}}); },
               "renderer gl:osmesa: draws only in host");
}

}  // namespace
}  // namespace pictura
