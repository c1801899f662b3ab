// Drawing kernels, run thread by thread on the host, compared with the oracle (the CPU renderer): all values are equal,
// for any order of threads. So these tests find broken kernels without a GPU.
#include <algorithm>
#include <functional>
#include <limits>
#include <memory>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/backend_cuda/renderer/scratch_buffers.h"
#include "pictura/backends/make_renderer.h"
#include "pictura/bench/soak.h"
#include "pictura/bench/truth/image_scenes.h"
#include "pictura/bench/truth/random_scenes.h"
#include "pictura/common/scene_file.h"
#include "pictura/tests/backend_cuda/renderer/emulated_renderer.h"
#include "pictura/tests/backend_cuda/renderer/equal_outputs.h"
#include "pictura/tests/golden/golden_scenes.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/keyed_views.h"
#include "pictura/tests/support/renderer_interface.h"

namespace pictura {

namespace {

using test::EmulatedRenderer;

template <typename Scene>  // Snapshot or SyntheticWorlds
void expect_oracles(EmulatedRenderer* renderer, const Scene& town, Planes planes = Planes::none) {
  const Outputs emulated = draw_outputs(renderer, town, planes);
  renderer->check();
  test::expect_equal(emulated, draw_outputs(make_renderer("cpu", renderer->config()).get(), town, planes));
}

// Random scenes, views, rigs and settings.
TEST(EmulatedKernels, DrawTheScenesOfASoak) {
  const SoakOptions options{.maps = {"procedural:1", "procedural:2"},
                            .agents = 60,
                            .views = 2,
                            .max_scenes = 8,
                            .max_seconds = std::numeric_limits<double>::infinity(),
                            .num_threads = 1};
  uint64_t order = 30;
  const SoakResult result = soak(
      options,
      [&](const RendererConfig& config, std::string*) { return std::make_unique<EmulatedRenderer>(config, order++); },
      [](const SoakResult&) {});
  EXPECT_EQ(result.scenes, 8);
  EXPECT_GT(result.error.values, 500'000);
  EXPECT_GT(result.error.plane_pixels, 50'000);
  EXPECT_GT(result.queries, 200);
  EXPECT_EQ(result.error.differing, 0);
  EXPECT_EQ(result.error.differing_plane_pixels, 0);
  EXPECT_EQ(result.differing_answers, 0);
}

RendererConfig config_of(const Rig& rig) { return {.rig = rig, .num_threads = 1}; }

TEST(EmulatedKernels, DrawTheOraclesTownsInAnyOrderOfThreads) {
  Snapshot town = make_synthetic_town(1, 120);
  town.views.resize(2);
  for (const uint64_t seed : {1, 2}) {
    EmulatedRenderer renderer(config_of(paper_rig()), seed);
    expect_oracles(&renderer, town);
    EXPECT_EQ(renderer.overflow(), 0);
  }
}

// Distant lines with the largest allowed minimum width, many to a pixel, which occlude each other in cycles.
TEST(EmulatedKernels, DrawTheWidestLinesInAnyOrderOfThreads) {
  Snapshot town = make_synthetic_town(1, 120);
  town.views.resize(4);
  RendererConfig config = config_of(paper_rig());
  config.line_floor_px = kGuardBand_px;
  for (const uint64_t seed : {19, 20}) {
    SCOPED_TRACE(seed);
    EmulatedRenderer renderer(config, seed);
    expect_oracles(&renderer, town);
  }
}

TEST(EmulatedKernels, DrawWorldsOfSeveralMaps) {
  EmulatedRenderer renderer(config_of(paper_rig()), 13);
  expect_oracles(&renderer, make_synthetic_worlds(), Planes::all);
}

TEST(EmulatedKernels, HideAllAgentsOrAllLights) {
  Snapshot town = make_synthetic_town(1, 120);
  town.views.resize(3);
  town.views[0].hides = kHidesAgents;
  town.views[1].hides = kHidesLights;
  town.views[2].hides = kHidesAgents | kHidesLights;
  EmulatedRenderer renderer(config_of(mixed_rig()), 15);
  expect_oracles(&renderer, town, Planes::all);
}

TEST(EmulatedKernels, DrawBlackWhereNothingIsVisible) {
  EmulatedRenderer renderer(config_of(mixed_rig()), 14);
  Snapshot town;
  town.geometry.build_grids();
  town.scene.end_world(0);
  town.views = {make_view({0, 0, 0}, 0)};
  expect_oracles(&renderer, town, Planes::all);
}

// Kernels report the errors that checks report to host callers. Images of such views are black.
TEST(EmulatedKernels, ReportInvalidViews) {
  const SyntheticWorlds valid = make_synthetic_worlds();
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  struct Case {
    const char* message;
    std::function<void(SyntheticWorlds*)> corrupt;
  };
  const Case cases[] = {
      {"view 1: no such world", [](auto* w) { w->views[1].world = 4; }},
      {"view 1: no such world", [](auto* w) { w->views[1].world = -1; }},
      {"view 1: its world has no such geometry", [](auto* w) { w->scene.geometry[0] = 2; }},
      {"view 1: expected a finite pose and hidden agents within the list",
       [](auto* w) { w->views[1].origin_m.z = kInfinity; }},
      {"view 1: expected a finite pose and hidden agents within the list",
       [](auto* w) { w->views[1].cos_heading = 2.0f; }},
      {"view 1: expected a finite pose and hidden agents within the list",
       [](auto* w) { w->views[1].body_length_m = kInfinity; }},
      {"view 1: expected a finite pose and hidden agents within the list",
       [](auto* w) { w->views[1].hidden_end = static_cast<int32_t>(w->scene.hidden_agents.size()) + 1; }},
      {"view 1: expected a finite pose and hidden agents within the list",
       [](auto* w) { std::swap(w->views[1].hidden_begin, w->views[1].hidden_end); }},
      {"view 1: its world has fewer light states than its map signals", [](auto* w) { w->scene.light_begin[1] = 1; }},
      {"view 1: its world has more than 8192 agents",
       [](auto* w) {
         w->scene.agents.resize(kMaxBoxesPerWorld + 1);
         w->scene.world_begin = {0, kMaxBoxesPerWorld + 1, kMaxBoxesPerWorld + 1, kMaxBoxesPerWorld + 1,
                                 kMaxBoxesPerWorld + 1};
       }},
  };
  const Rig rig = front_rig(16, 9);
  for (const Case& each : cases) {
    SyntheticWorlds worlds = valid;
    worlds.views.resize(2);
    worlds.views[0] = valid.views[3];  // a view of the empty world, so that its image is valid in all cases
    each.corrupt(&worlds);
    RendererConfig config = config_of(rig);
    config.randomization.noise_share = 0.1;
    EmulatedRenderer renderer(config, 15);
    upload_geometries(worlds.maps, &renderer);
    HostImages images(rig, 2);
    std::ranges::fill(images.bytes(), uint8_t{0xA5});
    renderer.render(worlds.scene.batch(), worlds.views, images.batch(), {});
    EXPECT_EQ(test::message_of([&] { renderer.check(); }), each.message);
    EXPECT_TRUE(std::ranges::all_of(images.interleaved(1, 0), [](uint8_t byte) { return byte == 0; })) << each.message;
    EXPECT_NO_THROW(renderer.check());
  }
}

TEST(EmulatedKernels, ReportInvalidQueries) {
  const SyntheticWorlds worlds = make_synthetic_worlds();
  const RendererConfig config = config_of(paper_rig(16, 9));
  EmulatedRenderer renderer(config, 16);
  upload_geometries(worlds.maps, &renderer);
  // The first view is in the first world, whose agents are first.
  const int32_t of_another_world = worlds.scene.world_begin[2];
  for (const VisibilityQuery bad :
       {VisibilityQuery{10, 0}, VisibilityQuery{-1, 0}, VisibilityQuery{0, -1}, VisibilityQuery{0, of_another_world}}) {
    const std::vector<VisibilityQuery> queries{{0, 1}, bad};
    std::vector<float> result(2, 7.0f);
    renderer.visibility(worlds.scene.batch(), worlds.views, queries, result, {});
    EXPECT_EQ(test::message_of([&] { renderer.check(); }),
              "visibility query 1: no such view, or no such agent in its world");
    EXPECT_TRUE(std::isnan(result[1]));
  }
}

// Draws a town with a pool that holds only some of its images.
void expect_some_deferred(uint64_t seed, const EmulatedRenderer::Pool& pool) {
  Snapshot town = make_synthetic_town(1, 120);
  town.views.resize(2);
  EmulatedRenderer renderer(config_of(paper_rig()), seed, pool);
  expect_oracles(&renderer, town);
  EXPECT_GT(renderer.deferred(), 0);
  EXPECT_LT(renderer.deferred(), 8);
  EXPECT_EQ(renderer.overflow(), 0);
}

TEST(EmulatedKernels, DeferViewsThatDoNotFitIntoThePool) { expect_some_deferred(7, {.faces = 192}); }
// The overflow is found after some of an image's faces have been set up.
TEST(EmulatedKernels, DeferWhenClippedEdgesDoNotFit) { expect_some_deferred(8, {.clipped_edges = 70}); }

TEST(EmulatedKernels, ClipLightsOnAllSides) {
  // A spiral of light heads around a camera, starting nearer than its near plane. The heads face the camera and overlap
  // each other's disks and all borders of the image. The batch contains no other objects.
  Snapshot town;
  for (int i = 0; i < 300; ++i) {
    const float angle = 0.4f * static_cast<float>(i), range_m = 0.05f + 0.02f * static_cast<float>(i);
    const SinCos at = sincos_of(angle);
    LightHead head;
    head.position_m = {range_m * at.cos, range_m * at.sin, 1.5f + 0.004f * static_cast<float>(i % 7 - 3) * range_m};
    head.facing = {-at.cos, -at.sin};
    head.signal = i;
    town.geometry.heads.push_back(head);
    town.scene.light_states.push_back(static_cast<LightState>(i % 4));
  }
  town.geometry.num_signals = 300;
  town.geometry.build_grids();
  town.scene.end_world(0);
  town.views = {make_view({0, 0, 0}, 0)};
  EmulatedRenderer renderer(config_of(mixed_rig()), 9);
  expect_oracles(&renderer, town, Planes::all);
  EXPECT_EQ(renderer.overflow(), 0);
}

// A strip that crosses itself along a border enters the frame twice, and has more corners than a lane can hold.
TEST(EmulatedKernels, ClipStripsThatCrossThemselves) {
  Snapshot town;
  for (int i = 0; i < 60; ++i) {
    const SinCos at = sincos_of(0.1f * static_cast<float>(i));
    const Vec2 ahead{at.cos, at.sin}, left = left_normal(ahead);
    const float near_m = 3.0f + 0.05f * static_cast<float>(i), far_m = near_m + 6.0f;
    Strip strip;
    strip.a_m = {near_m * ahead.x, near_m * ahead.y, 0};
    strip.b_m = {far_m * ahead.x, far_m * ahead.y, 0};
    strip.side_a = left;
    strip.side_b = left * -1.0f;
    strip.width_m = 4.0f;
    strip.color = kWhiteMarkColor;
    town.geometry.strips.push_back(strip);
  }
  town.geometry.build_grids();
  town.scene.end_world(0);
  for (int i = 0; i < 4; ++i) town.views.push_back(make_view({0.2f, 0.1f, 0}, 0.3f + 0.02f * static_cast<float>(i)));
  EmulatedRenderer renderer(config_of(mixed_rig()), 11);
  expect_oracles(&renderer, town, Planes::all);
  EXPECT_EQ(renderer.overflow(), 0);
}

TEST(EmulatedKernels, DrawOddSizesAndPlanes) {
  Snapshot town = make_synthetic_town(2, 60);
  town.views.resize(2);
  EmulatedRenderer renderer(config_of(mixed_rig()), 3);
  expect_oracles(&renderer, town, Planes::all);
}

TEST(EmulatedKernels, WriteAllFormatsAndOrdersAsTheOracleDoes) {
  Snapshot town = make_synthetic_town(3, 60);
  town.views.resize(1);
  const RendererConfig config = config_of(mixed_rig());
  EmulatedRenderer emulated(config, 12);
  const auto oracle = make_renderer("cpu", config);
  emulated.upload(0, town.geometry);
  oracle->upload(0, town.geometry);
  for (const PixelFormat format : {PixelFormat::u8, PixelFormat::f16, PixelFormat::bf16}) {
    // Zero means planar images.
    for (const int patch_px : {0, 4, 8, 12, 16}) {
      const ChannelOrder order = patch_px == 0 ? ChannelOrder::planar : ChannelOrder::patches;
      HostImages result(config.rig, 1, format, Planes::none, order, patch_px),
          expected(config.rig, 1, format, Planes::none, order, patch_px);
      std::ranges::fill(result.bytes(), uint8_t{0xA5});
      emulated.render(town.scene.batch(), town.views, result.batch(), {});
      oracle->render(town.scene.batch(), town.views, expected.batch(), {});
      EXPECT_TRUE(std::ranges::equal(result.bytes(), expected.bytes())) << static_cast<int>(format) << ", " << patch_px;
    }
  }
}

TEST(EmulatedKernels, RandomizeCamerasAsTheOracleDoes) {
  Snapshot town = make_synthetic_town(3, 60);
  town.views.resize(2);
  town.views = test::keyed(town.views);
  RendererConfig config = config_of(mixed_rig());
  config.randomization = scaled(kFullCameraSeverity, 2);
  config.randomization.seed = 5;
  EmulatedRenderer emulated(config, 21);
  expect_oracles(&emulated, town, Planes::all);
  const auto oracle = make_renderer("cpu", config);
  test::expect_equal_visibility(&emulated, oracle.get(), town);
  for (const auto& [format, order] :
       {std::pair{PixelFormat::u8, ChannelOrder::planar}, std::pair{PixelFormat::f16, ChannelOrder::planar},
        std::pair{PixelFormat::bf16, ChannelOrder::patches}}) {
    HostImages result(config.rig, 2, format, Planes::none, order), expected(config.rig, 2, format, Planes::none, order);
    std::ranges::fill(result.bytes(), uint8_t{0xA5});
    emulated.render(town.scene.batch(), town.views, result.batch(), {});
    oracle->render(town.scene.batch(), town.views, expected.batch(), {});
    EXPECT_TRUE(std::ranges::equal(result.bytes(), expected.bytes())) << static_cast<int>(format);
  }
}

TEST(EmulatedKernels, RandomizeCamerasOfImagesDrawnInParts) {
  Snapshot crowd = make_crowd();
  crowd.views = test::keyed(crowd.views);
  RendererConfig config = config_of(front_rig());
  config.randomization = kFullCameraSeverity;
  EmulatedRenderer renderer(config, 22);
  expect_oracles(&renderer, crowd, Planes::all);
  EXPECT_GT(renderer.overflow(), 0);
}

TEST(EmulatedKernels, DrawTooManyFragmentsInParts) {
  // More fragments than fit at once: tiles are drawn in parts, and images are left to the last launch.
  const Rig rig = front_rig();
  EmulatedRenderer renderer(config_of(rig), 4);
  expect_oracles(&renderer, make_crowd(), Planes::all);
  EXPECT_GT(renderer.overflow(), 0);
}

// Parts are as narrow as one pixel. Patches extend beyond the image at its right and bottom.
TEST(EmulatedKernels, DrawPartsIntoPatches) {
  const RendererConfig config = config_of(front_rig(30, 21));
  Snapshot crowd = make_crowd();
  crowd.views.resize(1);
  EmulatedRenderer emulated(config, 19);
  const auto oracle = make_renderer("cpu", config);
  emulated.upload(0, crowd.geometry);
  oracle->upload(0, crowd.geometry);
  for (const int patch_px : {4, 12, 16}) {
    HostImages result(config.rig, 1, PixelFormat::bf16, Planes::none, ChannelOrder::patches, patch_px),
        expected(config.rig, 1, PixelFormat::bf16, Planes::none, ChannelOrder::patches, patch_px);
    std::ranges::fill(result.bytes(), uint8_t{0xA5});
    emulated.render(crowd.scene.batch(), crowd.views, result.batch(), {});
    oracle->render(crowd.scene.batch(), crowd.views, expected.batch(), {});
    EXPECT_TRUE(std::ranges::equal(result.bytes(), expected.bytes())) << patch_px;
  }
  EXPECT_GT(emulated.overflow(), 0);
}

// The last launch draws images in tiles as high as its memory permits.
TEST(EmulatedKernels, DrawImagesHigherThanTheLastLaunchDrawsAtOnce) {
  const Rig rig = front_rig(24, 600);
  EmulatedRenderer renderer(config_of(rig), 17);
  Snapshot crowd = make_crowd();
  crowd.views.resize(1);
  expect_oracles(&renderer, crowd, Planes::all);
  EXPECT_GT(renderer.overflow(), 0);
}

// Each image has one face more than full batches, so the number of batches is the maximum.
TEST(EmulatedKernels, HaveCapacityForTheBatchesOfManyEqualImages) {
  constexpr int kFaces = cuda::FaceBatch::count_of(cuda::kPoolFaces) * cuda::FaceBatch::kEntries + 1;
  Snapshot town;
  for (int i = 0; i < kFaces; ++i) {
    const float x = 5.0f + 0.1f * static_cast<float>(i);
    town.geometry.walls.push_back({{x, -1, 0}, {x, 1, 0}, 1.0f + 0.02f * static_cast<float>(i)});
  }
  town.geometry.build_grids();
  town.scene.end_world(0);
  town.views.assign(24, make_view({0, 0, 0}, 0));
  const Rig rig = front_rig(4, 3);
  EmulatedRenderer renderer(config_of(rig), 18, {.faces = cuda::kPoolFaces, .clipped_edges = 128});
  expect_oracles(&renderer, town);
  EXPECT_GT(renderer.deferred(), 0);
}

TEST(EmulatedKernels, DrawPlanesOfMoreRowsThanFit) {
  // Walls stand one behind the other, each covering all rows of a tile.
  Snapshot town;
  for (int i = 0; i < 100; ++i) {
    const float x = 4.0f + 0.25f * static_cast<float>(i);
    town.geometry.walls.push_back({{x, -x, 0}, {x + 0.1f, x, 0}, 12.0f + static_cast<float>(i)});
  }
  town.geometry.build_grids();
  town.scene.end_world(0);
  town.views = {make_view({0, 0, 0}, 0)};
  const Rig rig = front_rig();
  EmulatedRenderer renderer(config_of(rig), 12);
  expect_oracles(&renderer, town, Planes::all);
  EXPECT_EQ(renderer.overflow(), 0);
}

TEST(EmulatedKernels, MeasureVisibility) {
  Snapshot town = make_synthetic_town(4, 30);
  town.views.resize(1);
  const RendererConfig config = config_of(paper_rig(48, 27));
  EmulatedRenderer emulated(config, 5);
  test::expect_equal_visibility(&emulated, make_renderer("cpu", config).get(), town);
}

test::MakeForRig maker(uint64_t first_seed) {
  return [seed = first_seed](const Rig& rig) mutable {
    return std::make_unique<EmulatedRenderer>(config_of(rig), seed++);
  };
}

TEST(EmulatedKernels, KeepMapsByHandle) { test::expect_maps_by_handle(maker(40)); }

TEST(EmulatedKernels, DrawTheCountedViews) {
  test::expect_counted_views(maker(50));
  test::expect_counted_queries(maker(60));
}

class EmulatedHardScenes : public testing::TestWithParam<HardScene> {};
INSTANTIATE_TEST_SUITE_P(All, EmulatedHardScenes, testing::ValuesIn(hard_scenes()),
                         [](const auto& scene) { return scene.param.name; });
TEST_P(EmulatedHardScenes, MatchTheOracle) {
  EmulatedRenderer renderer(config_of(GetParam().rig), 21);
  expect_oracles(&renderer, GetParam().town, Planes::all);
}

TEST(EmulatedKernels, DrawTheOraclesRandomScenes) {
  for (int kind = 0; kind < kNumRandomKinds; ++kind) {
    for (uint64_t seed = 0; seed < 2; ++seed) {
      const auto [town, config] = make_random_scene(static_cast<RandomKind>(kind), seed);
      EmulatedRenderer renderer(config, 70 + seed);
      expect_oracles(&renderer, town, Planes::all);
    }
  }
}

class EmulatedGoldenScenes : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(All, EmulatedGoldenScenes, testing::ValuesIn(golden_names(".toml")),
                         [](const auto& scene) { return scene.param; });
TEST_P(EmulatedGoldenScenes, MatchTheOracle) {
  const SceneFile scene = load_scene(scene_path(GetParam()));
  RendererConfig config = scene.config;
  config.num_threads = 1;
  EmulatedRenderer renderer(config, 6);
  expect_oracles(&renderer, Snapshot{scene.geometry, scene.scene, scene.views}, Planes::all);
}

}  // namespace
}  // namespace pictura
