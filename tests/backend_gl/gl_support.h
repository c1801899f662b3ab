// Shared by the tests of backend_gl/: skipping on machines without a library, and drawing in float.
#pragma once

#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "pictura/backends/make_renderer.h"
#include "pictura/bench/truth/image_scenes.h"
#include "pictura/common/error.h"

namespace pictura {

/// Why a renderer cannot run here, or an empty string. The test fails if PICTURA_REQUIRE_GL names the renderer.
inline std::string missing(const std::string& backend) {
  try {
    make_renderer(backend, {});
    return "";
  } catch (const Error& error) {
    const char* required = std::getenv("PICTURA_REQUIRE_GL");
    if (required && std::string(required).find(backend) != std::string::npos) {
      ADD_FAILURE() << "PICTURA_REQUIRE_GL=" << required << ", but " << error.what();
    }
    return error.what();
  }
}

/// Images of all views, in float, in the order of HostImages.
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
