// Small scenes drawn by the CPU renderer, for tests that check pixels.
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
  Rgb at(int x, int y, int image = 0) const {
    const auto plane = static_cast<std::size_t>(width_px * height_px);
    const std::size_t i = 3 * plane * static_cast<std::size_t>(image) + static_cast<std::size_t>(y * width_px + x);
    return {rgb[i], rgb[i + plane], rgb[i + 2 * plane]};
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
  return {rgb, config.rig.cameras[0].width_px, config.rig.cameras[0].height_px};
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
