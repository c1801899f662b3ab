// Drawing of float images.
#pragma once

#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "pictura/backends/make_renderer.h"
#include "pictura/bench/truth/image_scenes.h"
#include "pictura/tests/support/missing_renderer.h"

namespace pictura {

/// Returns all views' images as floats, in the order of HostImages.
inline std::vector<float> draw(const std::string& backend, const StaticGeometry& geometry, const SceneOwner& scene,
                               const std::vector<View>& views, const RendererConfig& config) {
  const auto renderer = make_renderer(backend, config);
  renderer->upload(0, geometry);
  HostImages images(config.rig, static_cast<int>(views.size()), PixelFormat::f32);
  renderer->render(scene.batch(), views, images.batch());
  std::vector<float> values(images.bytes().size() / sizeof(float));
  std::memcpy(values.data(), images.bytes().data(), images.bytes().size());
  return values;
}

}  // namespace pictura
