// The OpenGL renderer with scenes and images in device memory. Without a GPU, the tests are skipped; if
// PICTURA_REQUIRE_GPU is 1, they fail instead.
#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/common/cuda/device_scene.h"
#include "pictura/tests/backend_gl/gl_support.h"

namespace pictura {
namespace {

constexpr Device kGpu{MemorySpace::cuda, 0};

class GlInterop : public testing::Test {
 protected:
  void SetUp() override {
    try {
      make_renderer("gl:egl", {.device = kGpu});
    } catch (const Error& error) {
      const char* required = std::getenv("PICTURA_REQUIRE_GPU");
      if (required && std::string(required) == "1") FAIL() << "PICTURA_REQUIRE_GPU=1, but " << error.what();
      GTEST_SKIP() << error.what();
    }
  }
};

// All bytes of a camera's images in device memory, `stride` bytes from view to view, 0xA5 where unwritten.
struct DeviceImages {
  DeviceBuffer<uint8_t> bytes;
  CameraImages camera;
  DeviceImages(const Camera& of, std::size_t views, int64_t stride)
      : bytes(Span<const uint8_t>(std::vector<uint8_t>(views * static_cast<std::size_t>(stride), 0xA5))),
        camera{of.width_px, of.height_px, bytes.data(), stride} {}
  std::vector<uint8_t> on_host() const {
    std::vector<uint8_t> host(bytes.size());
    bytes.copy_to_host(host.data());
    return host;
  }
};

TEST_F(GlInterop, WritesEqualBytesToDeviceAndHostMemory) {
  Snapshot town = make_synthetic_town(1, 120);
  town.views.resize(12);
  for (const PixelSamples samples : {PixelSamples{}, PixelSamples{.multisample = 4}, PixelSamples{.grid = 4}}) {
    RendererConfig config{.rig = paper_rig(97, 55), .samples = samples};
    config.rig.cameras[1] = paper_rig(32, 18).cameras[1];
    const auto on_host = make_renderer("gl:egl", config);
    config.device = kGpu;
    const auto on_device = make_renderer("gl:egl", config);
    EXPECT_EQ(on_device->device(), kGpu);
    on_host->upload(0, town.geometry);
    on_device->upload(0, town.geometry);

    HostImages host_images(config.rig, 12);
    on_host->render(town.scene.batch(), town.views, host_images.batch());
    const DeviceScene scene(town.scene.batch());
    const DeviceBuffer<View> views{Span<const View>(town.views)};
    std::vector<DeviceImages> device_images;
    std::vector<CameraImages> cameras;
    constexpr int64_t kGap = 5;
    for (const Camera& camera : config.rig.cameras) {
      device_images.emplace_back(camera, town.views.size(), 3 * camera.width_px * camera.height_px + kGap);
      cameras.push_back(device_images.back().camera);
    }
    for (int repeat = 0; repeat < 2; ++repeat) {
      on_device->render(scene.batch(), views.span(), {kGpu, PixelFormat::u8, 12, cameras});
    }
    for (std::size_t k = 0; k < cameras.size(); ++k) {
      const std::vector<uint8_t> drawn = device_images[k].on_host();
      const CameraImages& expected = host_images.camera(static_cast<int>(k));
      const int64_t values = cameras[k].view_stride - kGap;
      for (int64_t view = 0; view < 12; ++view) {
        const auto first = drawn.begin() + view * cameras[k].view_stride;
        const auto* wanted = static_cast<const uint8_t*>(expected.data) + view * expected.view_stride;
        EXPECT_TRUE(std::equal(wanted, wanted + values, first)) << "camera " << k << ", view " << view;
        EXPECT_TRUE(std::all_of(first + values, first + values + kGap, [](uint8_t byte) { return byte == 0xA5; }));
      }
    }
  }
}

TEST_F(GlInterop, ASingleViewMayHaveAnyStride) {
  Snapshot town = make_synthetic_town(1, 60);
  town.views.resize(1);
  RendererConfig config{.rig = front_rig(97, 55)};
  const auto on_host = make_renderer("gl:egl", config);
  config.device = kGpu;
  const auto on_device = make_renderer("gl:egl", config);
  on_host->upload(0, town.geometry);
  on_device->upload(0, town.geometry);
  HostImages host_images(config.rig, 1);
  on_host->render(town.scene.batch(), town.views, host_images.batch());
  const DeviceScene scene(town.scene.batch());
  const DeviceBuffer<View> views{Span<const View>(town.views)};
  for (const int64_t stride : {int64_t{0}, int64_t{-1}, int64_t{1} << 40}) {
    DeviceImages device_images(config.rig.cameras[0], 1, 3 * 97 * 55);
    device_images.camera.view_stride = stride;
    on_device->render(scene.batch(), views.span(),
                      {kGpu, PixelFormat::u8, 1, Span<const CameraImages>(&device_images.camera, 1)});
    EXPECT_THAT(device_images.on_host(), testing::ElementsAreArray(host_images.bytes())) << stride;
  }
}

TEST_F(GlInterop, RefusesAHostScene) {
  Snapshot town = make_synthetic_town(1, 10);
  town.views.resize(1);
  const auto renderer = make_renderer("gl:egl", {.device = kGpu});
  renderer->upload(0, town.geometry);
  std::vector<CameraImages> cameras;
  uint8_t never_written = 0;
  for (const Camera& camera : renderer->config().rig.cameras) {
    cameras.push_back({camera.width_px, camera.height_px, &never_written, 3 * camera.width_px * camera.height_px});
  }
  try {
    renderer->render(town.scene.batch(), town.views, {kGpu, PixelFormat::u8, 1, cameras});
    FAIL() << "expected an Error";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("renderer gl:egl: scene: expected cuda:0, got cpu"));
  }
}

}  // namespace
}  // namespace pictura
