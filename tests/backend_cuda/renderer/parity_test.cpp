// The CUDA renderer compared with the oracle (the CPU renderer), on a device. Without a device, the tests are skipped;
// if PICTURA_REQUIRE_GPU is 1, they fail instead.
#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/backends/make_renderer.h"
#include "pictura/bench/truth/image_scenes.h"
#include "pictura/common/cuda/device_scene.h"
#include "pictura/common/error.h"
#include "pictura/common/scene_file.h"
#include "pictura/tests/backend_cuda/device_test.h"
#include "pictura/tests/backend_cuda/renderer/equal_outputs.h"
#include "pictura/tests/golden/golden_scenes.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/keyed_views.h"
#include "pictura/tests/support/renderer_interface.h"

namespace pictura {

namespace {

using testing::HasSubstr;

class CudaRendererTest : public test::DeviceTest {};

template <typename Scene>  // Snapshot or SyntheticWorlds
void expect_parity(const Scene& town, const RendererConfig& config) {
  const auto oracle = make_renderer("cpu", config), device = make_renderer("cuda", config);
  test::expect_equal(draw_outputs(device.get(), town, Planes::all), draw_outputs(oracle.get(), town, Planes::all));
}

void expect_parity_of_visibility(const Snapshot& town, const RendererConfig& config) {
  const auto oracle = make_renderer("cpu", config), device = make_renderer("cuda", config);
  test::expect_equal_visibility(device.get(), oracle.get(), town);
}

TEST_F(CudaRendererTest, TownsMatchTheOracle) { expect_parity(make_synthetic_town(1, 120), {.rig = paper_rig()}); }

TEST_F(CudaRendererTest, OddSizesAndMixedRigsMatchTheOracle) {
  Snapshot town = make_synthetic_town(2, 60);
  town.views.resize(5);
  expect_parity(town, {.rig = mixed_rig(), .line_floor_px = 0});
}

TEST_F(CudaRendererTest, WorldsOfSeveralMapsMatchTheOracle) {
  expect_parity(make_synthetic_worlds(), {.rig = paper_rig()});
}

TEST_F(CudaRendererTest, RandomizedCamerasMatchTheOracle) {
  Snapshot town = make_synthetic_town(2, 60);
  town.views.resize(5);
  town.views = test::keyed(town.views);
  for (const Rig& rig : {paper_rig(), mixed_rig()}) {
    RendererConfig config{.rig = rig, .randomization = scaled(kFullCameraSeverity, 2)};
    config.randomization.seed = 5;
    expect_parity(town, config);
    expect_parity_of_visibility(town, config);
    const auto oracle = make_renderer("cpu", config), device = make_renderer("cuda", config);
    oracle->upload(0, town.geometry);
    device->upload(0, town.geometry);
    for (const PixelFormat format : {PixelFormat::u8, PixelFormat::f16, PixelFormat::bf16}) {
      for (const ChannelOrder order : {ChannelOrder::planar, ChannelOrder::patches}) {
        HostImages result(rig, 5, format, Planes::none, order), expected(rig, 5, format, Planes::none, order);
        device->render(town.scene.batch(), town.views, result.batch());
        oracle->render(town.scene.batch(), town.views, expected.batch());
        EXPECT_TRUE(std::ranges::equal(result.bytes(), expected.bytes())) << static_cast<int>(format);
      }
    }
  }
}

// Sizes of the paper, and one screen-sized image; each builds its own kernels.
class CudaRendererSizes : public CudaRendererTest, public testing::WithParamInterface<int> {};
TEST_P(CudaRendererSizes, MatchTheOracle) {
  Snapshot town = make_synthetic_town(6, 80);
  town.views.resize(3);
  expect_parity(town, {.rig = paper_rig(GetParam(), GetParam() * 9 / 16)});
}
INSTANTIATE_TEST_SUITE_P(Widths, CudaRendererSizes, testing::Values(32, 64, 96, 192, 384, 768));

TEST_F(CudaRendererTest, CrowdsInImagesOfManyRowsMatchTheOracle) {
  expect_parity(make_crowd(), {.rig = paper_rig(64, 1100)});
}

TEST_F(CudaRendererTest, CrowdedImagesAreComplete) { expect_parity(make_crowd(), {.rig = paper_rig()}); }

TEST_F(CudaRendererTest, VisibilityMatchesTheOracle) {
  Snapshot town = make_synthetic_town(4, 60);
  town.views.resize(3);
  expect_parity_of_visibility(town, {.rig = paper_rig()});
}

class CudaHardScenes : public CudaRendererTest, public testing::WithParamInterface<HardScene> {};
INSTANTIATE_TEST_SUITE_P(All, CudaHardScenes, testing::ValuesIn(hard_scenes()),
                         [](const auto& scene) { return scene.param.name; });
TEST_P(CudaHardScenes, MatchTheOracle) { expect_parity(GetParam().town, {.rig = GetParam().rig}); }
TEST_P(CudaHardScenes, VisibilityMatchesTheOracle) {
  expect_parity_of_visibility(GetParam().town, {.rig = GetParam().rig});
}

// Values and planes of golden scenes; golden_test compares their pictures in bytes.
class CudaGoldenScenes : public CudaRendererTest, public testing::WithParamInterface<std::string> {};
INSTANTIATE_TEST_SUITE_P(All, CudaGoldenScenes, testing::ValuesIn(golden_names(".toml")),
                         [](const auto& scene) { return scene.param; });
TEST_P(CudaGoldenScenes, MatchTheOracle) {
  const SceneFile scene = load_scene(scene_path(GetParam()));
  expect_parity(Snapshot{scene.geometry, scene.scene, scene.views}, scene.config);
}

TEST_F(CudaRendererTest, FaultsOfTheDeviceAreThrownByTheNextCall) {
  Snapshot town = make_synthetic_town(5, 5);
  town.views.resize(1);
  const RendererConfig config{.rig = paper_rig(8, 8), .device = {MemorySpace::cuda, 0}};
  const auto renderer = make_renderer("cuda", config);
  renderer->upload(0, town.geometry);
  const DeviceScene scene(town.scene.batch());
  HostImages shape(config.rig, 1);
  DeviceBuffer<uint8_t> memory(shape.bytes().size());
  std::vector<CameraImages> cameras;
  for (int k = 0; k < 4; ++k) cameras.push_back(camera_images(shape.layout(), k, memory.data()));
  const ImageBatch images{config.device, PixelFormat::u8, 1, cameras};
  std::vector<View> bad = town.views;
  bad[0].world = 9;
  const DeviceBuffer<View> views{Span<const View>(bad)}, good{Span<const View>(town.views)};
  EXPECT_NO_THROW(renderer->render(scene.batch(), views.span(), images));
  PICTURA_CUDA(cudaDeviceSynchronize());
  try {
    renderer->render(scene.batch(), good.span(), images);
    ADD_FAILURE() << "expected the fault of the earlier call";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("no such world"));
  }
  EXPECT_NO_THROW(renderer->render(scene.batch(), good.span(), images));
  EXPECT_NO_THROW(renderer->check());
  // An error is also reported when the caller asks for it.
  EXPECT_NO_THROW(renderer->render(scene.batch(), views.span(), images));
  EXPECT_THROW(renderer->check(), Error);
  EXPECT_NO_THROW(renderer->check());
  // Errors that the host can detect are reported at once.
  EXPECT_THROW(renderer->render(town.scene.batch(), good.span(), images), Error);
  EXPECT_THROW(renderer->render(scene.batch(), good.span(), shape.batch()), Error);
}

TEST_F(CudaRendererTest, ErrorsNameTheWrongDevice) {
  RendererConfig config{.rig = paper_rig(8, 8), .device = {MemorySpace::cuda, 0}};
  const auto renderer = make_renderer("cuda", config);
  EXPECT_EQ(renderer->device(), config.device);
  const Snapshot town = make_synthetic_town(5, 5);
  const DeviceScene on_device(town.scene.batch());
  DeviceImages staged;
  HostImages images(config.rig, 0);
  const ImageBatch none = staged.like(images.batch());
  auto told = [&](const SceneBatch& scene, const ImageBatch& out) {
    return test::message_of([&] { renderer->render(scene, {}, out); });
  };
  EXPECT_EQ(told(on_device.batch(), none), test::kNoError);
  EXPECT_EQ(told(town.scene.batch(), none), "renderer cuda: scene: expected cuda:0, got cpu");
  EXPECT_EQ(told(on_device.batch(), images.batch()), "renderer cuda: images: expected cuda:0, got cpu");
  SceneBatch elsewhere = on_device.batch();
  elsewhere.device.index = 1;
  EXPECT_EQ(told(elsewhere, none), "renderer cuda: scene: expected cuda:0, got cuda:1");
  config.device.index = 99;
  EXPECT_THAT(test::message_of([&] { make_renderer("cuda", config); }), HasSubstr("renderer cuda: device: expected"));
}

// Callers need not make the renderer's device current; the call restores the current device.
TEST_F(CudaRendererTest, DrawsOnItsDeviceForAnyCurrentDevice) {
  int devices = 0;
  PICTURA_CUDA(cudaGetDeviceCount(&devices));
  if (devices < 2) GTEST_SKIP() << "needs two CUDA devices";
  Snapshot town = make_synthetic_town(1, 20);
  town.views.resize(2);
  const RendererConfig config{.rig = paper_rig(16, 9), .device = {MemorySpace::cuda, 1}};
  const auto renderer = make_renderer("cuda", config);
  EXPECT_EQ(current_device().index, 0);
  renderer->upload(0, town.geometry);
  HostImages images(config.rig, 2), expected(config.rig, 2);
  {
    const DeviceGuard there(config.device);
    const DeviceScene scene(town.scene.batch());
    const DeviceBuffer<View> views{Span<const View>(town.views)};
    DeviceImages staged;
    const ImageBatch batch = staged.like(images.batch());
    {
      const DeviceGuard here({MemorySpace::cuda, 0});
      renderer->render(scene.batch(), views.span(), batch);
      renderer->check();
      EXPECT_EQ(current_device().index, 0);
    }
    staged.copy_to_host(images.batch());
    PICTURA_CUDA(cudaDeviceSynchronize());
  }
  EXPECT_EQ(current_device().index, 0);
  const auto oracle = make_renderer("cpu", {.rig = config.rig});
  oracle->upload(0, town.geometry);
  oracle->render(town.scene.batch(), town.views, expected.batch());
  EXPECT_TRUE(std::ranges::equal(images.bytes(), expected.bytes()));
}

std::unique_ptr<Renderer> make_for_host(const Rig& rig) { return make_renderer("cuda", {.rig = rig}); }

TEST_F(CudaRendererTest, KeepsMapsByHandle) {
  test::expect_maps_by_handle(make_for_host);
  test::expect_refused_handles(make_for_host);
  test::expect_refused_order(make_for_host);
}

TEST_F(CudaRendererTest, DrawsPatches) { test::expect_patches(make_for_host); }

TEST_F(CudaRendererTest, DrawsTheCountedViews) {
  test::expect_counted_views(make_for_host);
  test::expect_counted_queries(make_for_host);
}

// Host data is checked on the host, before the device reads it.
TEST_F(CudaRendererTest, HostInputIsCheckedAtOnce) {
  Snapshot town = make_synthetic_town(5, 5);
  const RendererConfig config{.rig = paper_rig(8, 8)};
  const auto renderer = make_renderer("cuda", config);
  renderer->upload(0, town.geometry);
  EXPECT_EQ(renderer->device(), Device{});
  HostImages images(config.rig, static_cast<int>(town.views.size()));
  EXPECT_NO_THROW(renderer->render(town.scene.batch(), town.views, images.batch()));
  std::vector<View> bad = town.views;
  bad[0].world = 9;
  EXPECT_THROW(renderer->render(town.scene.batch(), bad, images.batch()), Error);
  std::vector<float> answer(1);
  const std::vector<VisibilityQuery> query{{0, 99}};
  EXPECT_THROW(renderer->visibility(town.scene.batch(), town.views, query, answer), Error);
  EXPECT_NO_THROW(renderer->render(town.scene.batch(), town.views, images.batch()));
}

}  // namespace
}  // namespace pictura
