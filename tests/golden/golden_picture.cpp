#include "pictura/tests/golden/golden_picture.h"

#include <algorithm>
#include <cmath>

#include "pictura/common/error.h"

namespace pictura {

namespace {

constexpr int kGap_px = 2, kEnlargement = 4;
constexpr float kContrast = 8;
constexpr uint8_t kGapGrey = 96;

std::size_t num_cameras(const SceneFile& scene) { return scene.config.rig.cameras.size(); }

struct PictureSize {
  int width_px = 0, height_px = 0, row_px = 0;
};

PictureSize size_of(const SceneFile& scene) {
  PictureSize size;
  for (const Camera& camera : scene.config.rig.cameras) {
    size.width_px += camera.width_px + kGap_px;
    size.row_px = std::max(size.row_px, camera.height_px + kGap_px);
  }
  size.width_px -= kGap_px;
  size.height_px = size.row_px * static_cast<int>(scene.views.size()) - kGap_px;
  return size;
}

// Calls visit(image, index of a channel value in the image, index of that value in the picture) for all values.
template <typename Visit>
void visit_values(const SceneFile& scene, Visit&& visit) {
  const PictureSize size = size_of(scene);
  for (std::size_t view = 0; view < scene.views.size(); ++view) {
    int left_px = 0;
    for (std::size_t k = 0; k < num_cameras(scene); ++k) {
      const Camera& camera = scene.config.rig.cameras[k];
      std::size_t value = 0;
      for (int channel = 0; channel < 3; ++channel) {
        for (int y = static_cast<int>(view) * size.row_px, end = y + camera.height_px; y < end; ++y) {
          for (int x = left_px; x < left_px + camera.width_px; ++x) {
            visit(view * num_cameras(scene) + k, value++,
                  static_cast<std::size_t>(3 * (y * size.width_px + x) + channel));
          }
        }
      }
      left_px += camera.width_px + kGap_px;
    }
  }
}

}  // namespace

Drawing draw_scene(Renderer* renderer, const SceneFile& scene, PixelFormat format) {
  renderer->upload(0, scene.geometry);
  HostImages images(scene.config.rig, static_cast<int>(scene.views.size()), format);
  renderer->render(scene.scene.batch(), scene.views, images.batch());
  Drawing drawing;
  for (std::size_t view = 0; view < scene.views.size(); ++view) {
    for (std::size_t k = 0; k < num_cameras(scene); ++k) {
      const CameraImages& camera = images.camera(static_cast<int>(k));
      const int64_t begin = static_cast<int64_t>(view) * camera.view_stride;
      std::vector<float>& image =
          drawing.emplace_back(static_cast<std::size_t>(3 * camera.width_px * camera.height_px));
      for (std::size_t i = 0; i < image.size(); ++i) {
        const std::size_t at = static_cast<std::size_t>(begin) + i;
        image[i] = format == PixelFormat::u8 ? static_cast<const uint8_t*>(camera.data)[at] / 255.0f
                                             : static_cast<const float*>(camera.data)[at];
      }
    }
  }
  return drawing;
}

Drawing trace_scene(const SceneFile& scene) {
  Drawing drawing;
  for (const View& view : scene.views) {
    for (const Camera& camera : scene.config.rig.cameras) {
      drawing.push_back(trace_image(scene.geometry, scene.scene.batch(), view, camera, scene.config.line_floor_px).rgb);
    }
  }
  return drawing;
}

RgbImage to_picture(const SceneFile& scene, const Drawing& drawing) {
  const PictureSize size = size_of(scene);
  RgbImage picture{size.width_px, size.height_px, {}};
  picture.rgb.assign(3 * size.width_px * size.height_px, kGapGrey);
  visit_values(scene, [&](std::size_t image, std::size_t value, std::size_t at) {
    picture.rgb[at] = static_cast<uint8_t>(std::lround(255 * clamp(drawing[image][value], 0.0f, 1.0f)));
  });
  return picture;
}

Drawing from_picture(const SceneFile& scene, const RgbImage& picture) {
  const PictureSize size = size_of(scene);
  PICTURA_CHECK(picture.width_px == size.width_px && picture.height_px == size.height_px,
                "expected a picture of {}x{} pixels, got {}x{}", size.width_px, size.height_px, picture.width_px,
                picture.height_px);
  Drawing drawing(scene.views.size() * num_cameras(scene));
  visit_values(scene, [&](std::size_t image, std::size_t, std::size_t at) {
    drawing[image].push_back(static_cast<float>(picture.rgb[at]) / 255.0f);
  });
  return drawing;
}

Drawing difference(const Drawing& a, const Drawing& b) {
  Drawing result = a;
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t k = 0; k < a[i].size(); ++k) result[i][k] = kContrast * std::abs(a[i][k] - b[i][k]);
  }
  return result;
}

RgbImage enlarged(const RgbImage& picture) {
  RgbImage out{kEnlargement * picture.width_px, kEnlargement * picture.height_px, {}};
  for (int y = 0; y < out.height_px; ++y) {
    for (int x = 0; x < out.width_px; ++x) {
      const auto* pixel = &picture.rgb[3 * (y / kEnlargement * picture.width_px + x / kEnlargement)];
      out.rgb.insert(out.rgb.end(), pixel, pixel + 3);
    }
  }
  return out;
}

PooledError error_of(const Drawing& actual, const Drawing& expected) {
  PICTURA_CHECK(actual.size() == expected.size(), "expected {} images, got {}", expected.size(), actual.size());
  PooledError error;
  for (std::size_t i = 0; i < actual.size(); ++i) error.add(actual[i], expected[i]);
  return error;
}

std::string complaint(const PooledError& error, const ImageTolerance& tolerance) {
  // Rounding error of floats converted from bytes.
  const double rounding = 1e-4 / 255;
  if (error.max_error() > tolerance.worst + rounding) {
    return fmt::format("worst value {:.2f}/255 off, expected at most {:.2f}/255", 255 * error.max_error(),
                       255 * tolerance.worst);
  }
  if (error.share_above(tolerance.usual + rounding) > tolerance.share_above_usual) {
    return fmt::format("{:.4f} % of the values more than {:.2f}/255 off, expected at most {:.4f} %",
                       100 * error.share_above(tolerance.usual + rounding), 255 * tolerance.usual,
                       100 * tolerance.share_above_usual);
  }
  if (error.psnr_db() < tolerance.min_psnr_db) {
    return fmt::format("{:.2f} dB, expected at least {:.2f} dB", error.psnr_db(), tolerance.min_psnr_db);
  }
  return "";
}

}  // namespace pictura
