// Small scenes drawn by the CPU renderer.
#pragma once

#include <cstring>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "pictura/backends/make_renderer.h"
#include "pictura/bench/truth/image_scenes.h"

namespace pictura {

struct Drawn {
  std::vector<float> rgb;
  int width_px, height_px;
  ImageLayout layout;
  Rgb at(int x, int y, int view = 0) const {
    const CameraLayout& camera = layout.cameras[0];
    const int64_t first = camera.offset + view * camera.view_stride + y * camera.row_stride + x * camera.pixel_stride;
    auto channel = [&](int c) { return rgb[first + c * camera.channel_stride]; };
    return {channel(0), channel(1), channel(2)};
  }
};

inline Drawn draw(const StaticGeometry& geometry, const SceneOwner& scene, const std::vector<View>& views,
                  const RendererConfig& config) {
  const auto renderer = make_renderer("cpu", config);
  renderer->upload(0, geometry);
  HostImages images(config.rig, static_cast<int>(views.size()), PixelFormat::f32);
  renderer->render(scene.batch(), views, images.batch());
  const auto bytes = images.bytes();
  std::vector<float> rgb(bytes.size() / sizeof(float));
  std::memcpy(rgb.data(), bytes.data(), bytes.size());
  return {rgb, config.rig.cameras[0].width_px, config.rig.cameras[0].height_px, images.layout()};
}

inline StaticGeometry no_geometry() {
  StaticGeometry geometry;
  geometry.build_grids();
  return geometry;
}

inline SceneOwner scene_of(std::vector<AgentBox> agents) {
  SceneOwner scene;
  scene.agents = std::move(agents);
  scene.end_world(0);
  return scene;
}

inline void expect_color(Rgb actual, Rgb expected, float tolerance = 1e-5f) {
  EXPECT_NEAR(actual.r, expected.r, tolerance);
  EXPECT_NEAR(actual.g, expected.g, tolerance);
  EXPECT_NEAR(actual.b, expected.b, tolerance);
}

}  // namespace pictura
