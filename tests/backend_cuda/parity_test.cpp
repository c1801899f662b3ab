// The CUDA renderer against the oracle, on a device. Without one these tests are skipped, unless PICTURA_REQUIRE_GPU=1
// says that there must be one.
#include <algorithm>
#include <cmath>
#include <cstring>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/common/cuda/device_scene.cuh"
#include "pictura/common/error.h"
#include "pictura/common/make_renderer.h"
#include "pictura/tests/backend_cuda/device_test.h"
#include "pictura/tests/support/image_scenes.h"
#include "pictura/tests/support/image_truth.h"
#include "pictura/tests/support/tolerances.h"

namespace pictura {

namespace {

using testing::HasSubstr;

class CudaRendererTest : public test::DeviceTest {};

template <typename Scene>  // SyntheticTown or SyntheticWorlds
Outputs draw(const std::string& backend, const Scene& town, const RendererConfig& config) {
  return draw_outputs(make_renderer(backend, config).get(), town, Planes::all);
}

template <typename Scene>
void expect_parity(const Scene& town, const RendererConfig& config) {
  const Outputs host = draw("cpu", town, config), device = draw("cuda", town, config);
  ASSERT_EQ(host.color.size(), device.color.size());
  std::size_t within = 0, equal = 0;
  double worst = 0;
  for (std::size_t i = 0; i < host.color.size(); ++i) {
    const double error = value_error(static_cast<double>(device.color[i]), static_cast<double>(host.color[i]));
    within += error <= kKernelError;
    equal += error == 0;
    worst = std::max(worst, error);
  }
  const double count = static_cast<double>(host.color.size());
  fmt::print("{} values: {:.6f} % equal, {:.6f} % within 1/255, worst {:.4f}/255\n", host.color.size(),
             100 * static_cast<double>(equal) / count, 100 * static_cast<double>(within) / count, 255 * worst);
  EXPECT_GE(static_cast<double>(within), kKernelShareWithin * count);
  EXPECT_LE(worst, kKernelWorstError);
  // Planes are of one surface or another at a pixel's centre: no rounding shows but at edges.
  std::size_t differ = 0;
  for (std::size_t i = 0; i < host.depth_m.size(); ++i) {
    differ += host.class_id[i] != device.class_id[i] || host.instance_id[i] != device.instance_id[i] ||
              !is_same_depth(static_cast<double>(device.depth_m[i]), static_cast<double>(host.depth_m[i]));
  }
  EXPECT_LE(static_cast<double>(differ), (1 - kKernelShareWithin) * static_cast<double>(host.depth_m.size()));
}

TEST_F(CudaRendererTest, TownsLookLikeTheOracle) { expect_parity(make_synthetic_town(1, 120), {.rig = paper_rig()}); }

TEST_F(CudaRendererTest, OddSizesAndMixedRigsDoToo) {
  SyntheticTown town = make_synthetic_town(2, 60);
  town.views.resize(5);
  expect_parity(town, {.rig = mixed_rig(), .line_floor_px = 0});
}

TEST_F(CudaRendererTest, WorldsOfSeveralMapsDoToo) { expect_parity(make_synthetic_worlds(), {.rig = paper_rig()}); }

// The paper's sizes, and one that a screen shows; each has kernels of its own to build.
class CudaRendererSizes : public CudaRendererTest, public testing::WithParamInterface<int> {};
TEST_P(CudaRendererSizes, DoToo) {
  SyntheticTown town = make_synthetic_town(6, 80);
  town.views.resize(3);
  expect_parity(town, {.rig = paper_rig(GetParam(), GetParam() * 9 / 16)});
}
INSTANTIATE_TEST_SUITE_P(Widths, CudaRendererSizes, testing::Values(32, 64, 96, 192, 384, 768));

TEST_F(CudaRendererTest, CrowdsInImagesOfManyRowsDoToo) { expect_parity(make_crowd(), {.rig = paper_rig(64, 1100)}); }

TEST_F(CudaRendererTest, NothingIsCutOffInCrowdedImages) { expect_parity(make_crowd(), {.rig = paper_rig()}); }

TEST_F(CudaRendererTest, VisibilityAgrees) {
  SyntheticTown town = make_synthetic_town(4, 60);
  town.views.resize(3);
  std::vector<VisibilityQuery> queries;
  for (int32_t view = 0; view < 3; ++view) {
    for (int32_t agent = 0; agent < 60; ++agent) queries.push_back({view, agent});
  }
  const RendererConfig config{.rig = paper_rig()};
  const auto host = make_renderer("cpu", config), device = make_renderer("cuda", config);
  host->upload(town.geometry);
  device->upload(town.geometry);
  std::vector<float> expected(queries.size()), actual(queries.size());
  host->visibility(town.scene.batch(), town.views, queries, expected);
  device->visibility(town.scene.batch(), town.views, queries, actual);
  for (std::size_t i = 0; i < queries.size(); ++i) {
    if (std::isnan(expected[i])) {
      EXPECT_TRUE(std::isnan(actual[i])) << i;
    } else {
      EXPECT_EQ(actual[i], expected[i]) << i;  // sums are of whole units
    }
  }
}

TEST_F(CudaRendererTest, FaultsOfTheDeviceAreThrownByTheNextCall) {
  SyntheticTown town = make_synthetic_town(5, 5);
  town.views.resize(1);
  const RendererConfig config{.rig = paper_rig(8, 8), .space = MemorySpace::cuda};
  const auto renderer = make_renderer("cuda", config);
  renderer->upload(town.geometry);
  const DeviceScene scene(town.scene.batch());
  HostImages shape(config.rig, 1);
  DeviceBuffer<uint8_t> memory(shape.bytes().size());
  std::vector<CameraImages> cameras;
  for (std::size_t k = 0; k < 4; ++k) {
    cameras.push_back(shape.camera(static_cast<int>(k)));
    cameras[k].data = memory.data() + 3 * 64 * k;
  }
  const ImageBatch images{MemorySpace::cuda, PixelFormat::u8, 1, cameras};
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
  // ... or when it is asked for.
  EXPECT_NO_THROW(renderer->render(scene.batch(), views.span(), images));
  EXPECT_THROW(renderer->check(), Error);
  EXPECT_NO_THROW(renderer->check());
  // What the host can see is refused at once.
  EXPECT_THROW(renderer->render(town.scene.batch(), good.span(), images), Error);
  EXPECT_THROW(renderer->render(scene.batch(), good.span(), shape.batch()), Error);
}

// What lies on the host is checked there, before the device sees it.
TEST_F(CudaRendererTest, HostCallersLearnAtOnceWhatIsWrong) {
  SyntheticTown town = make_synthetic_town(5, 5);
  const RendererConfig config{.rig = paper_rig(8, 8)};
  const auto renderer = make_renderer("cuda", config);
  renderer->upload(town.geometry);
  EXPECT_EQ(renderer->space(), MemorySpace::host);
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
