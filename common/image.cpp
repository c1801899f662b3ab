#include "pictura/common/image.h"

#include <map>

#include <png.h>

#include "pictura/common/error.h"
#include "pictura/common/support/file.h"

namespace pictura {

std::size_t bytes_per_value(PixelFormat format) {
  switch (format) {
    case PixelFormat::u8: return 1;
    case PixelFormat::f16: return 2;
    default: return 4;
  }
}

HostImages::HostImages(const Rig& rig, int num_views, PixelFormat format, Planes planes)
    : format_(format), num_views_(num_views) {
  validate(rig);
  PICTURA_CHECK(num_views >= 0, "images: expected a number of views of 0 or more, got {}", num_views);

  // One block [views, cameras of this size, 3, height, width] per distinct size.
  std::map<std::pair<int, int>, int64_t> cameras_of_size;
  for (const Camera& camera : rig.cameras) ++cameras_of_size[{camera.width_px, camera.height_px}];
  struct Block {
    std::size_t begin_bytes = 0;
    int64_t next_camera = 0;
  };
  std::map<std::pair<int, int>, Block> blocks;
  std::size_t total_bytes = 0;
  for (const Camera& camera : rig.cameras) {
    const std::pair<int, int> size{camera.width_px, camera.height_px};
    if (blocks.contains(size)) continue;
    blocks[size].begin_bytes = total_bytes;
    total_bytes += static_cast<std::size_t>(num_views) * static_cast<std::size_t>(cameras_of_size[size]) * 3 *
                   static_cast<std::size_t>(size.first) * static_cast<std::size_t>(size.second) *
                   bytes_per_value(format);
  }
  bytes_.resize(total_bytes);
  for (const Camera& camera : rig.cameras) {
    const std::pair<int, int> size{camera.width_px, camera.height_px};
    const int64_t image_values = int64_t{3} * size.first * size.second;
    Block& block = blocks[size];
    CameraImages images;
    images.width_px = size.first;
    images.height_px = size.second;
    images.data = bytes_.data() + block.begin_bytes +
                  static_cast<std::size_t>(block.next_camera++ * image_values) * bytes_per_value(format);
    images.view_stride = cameras_of_size[size] * image_values;
    cameras_.push_back(images);
  }
  if (planes == Planes::none) return;
  std::size_t pixels = 0;
  auto pixels_of = [&](const CameraImages& camera) {
    return static_cast<std::size_t>(num_views) * static_cast<std::size_t>(camera.width_px) *
           static_cast<std::size_t>(camera.height_px);
  };
  for (const CameraImages& camera : cameras_) pixels += pixels_of(camera);
  depth_m_.resize(pixels);
  class_id_.resize(pixels);
  instance_id_.resize(pixels);
  pixels = 0;
  for (CameraImages& camera : cameras_) {
    camera.depth_m = depth_m_.data() + pixels;
    camera.class_id = class_id_.data() + pixels;
    camera.instance_id = instance_id_.data() + pixels;
    pixels += pixels_of(camera);
  }
}

ImageBatch HostImages::batch() { return {Device{}, format_, num_views_, cameras_}; }

std::vector<uint8_t> HostImages::interleaved(int view, int camera_index) const {
  PICTURA_CHECK(format_ == PixelFormat::u8, "images: expected the u8 format");
  const CameraImages& images = camera(camera_index);
  const auto pixels = static_cast<std::size_t>(images.width_px) * static_cast<std::size_t>(images.height_px);
  const auto* planes = static_cast<const uint8_t*>(images.data) + view * images.view_stride;
  std::vector<uint8_t> rgb(3 * pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    for (std::size_t channel = 0; channel < 3; ++channel) rgb[3 * i + channel] = planes[channel * pixels + i];
  }
  return rgb;
}

void write_png(const std::string& path, int width_px, int height_px, Span<const uint8_t> rgb) {
  PICTURA_CHECK(
      width_px > 0 && height_px > 0 &&
          rgb.size() == std::size_t{3} * static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px),
      "{}: expected {}x{} RGB pixels, got {} bytes", path, width_px, height_px, rgb.size());
  write_renamed(path, [&](const std::string& temporary) {
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    image.width = static_cast<png_uint_32>(width_px);
    image.height = static_cast<png_uint_32>(height_px);
    image.format = PNG_FORMAT_RGB;
    const int written = png_image_write_to_file(&image, temporary.c_str(), 0, rgb.data(), 0, nullptr);
    PICTURA_CHECK(written, "{}: cannot be written: {}", path, image.message);
  });
}

RgbImage read_png(const std::string& path) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  PICTURA_CHECK(png_image_begin_read_from_file(&image, path.c_str()), "{}: not a readable PNG: {}", path,
                image.message);
  image.format = PNG_FORMAT_RGB;
  RgbImage result{static_cast<int>(image.width), static_cast<int>(image.height), {}};
  result.rgb.resize(PNG_IMAGE_SIZE(image));
  PICTURA_CHECK(png_image_finish_read(&image, nullptr, result.rgb.data(), 0, nullptr), "{}: not a readable PNG: {}",
                path, image.message);
  return result;
}

}  // namespace pictura
