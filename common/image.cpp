#include "pictura/common/image.h"

#include <algorithm>
#include <csetjmp>
#include <new>
#include <utility>

#include <png.h>

#include "pictura/common/error.h"
#include "pictura/common/support/interrupt.h"
#include "pictura/common/support/output_file.h"

namespace pictura {

std::size_t bytes_per_value(PixelFormat format) {
  switch (format) {
    case PixelFormat::u8: return 1;
    case PixelFormat::f16:
    case PixelFormat::bf16: return 2;
    default: return 4;
  }
}

std::string_view name_of(ChannelOrder order) {
  switch (order) {
    case ChannelOrder::planar: return "planar";
    case ChannelOrder::interleaved: return "interleaved";
    default: return "patches";
  }
}

constexpr int64_t kChannels = 3;

int64_t image_values(ImageSize size, ChannelOrder order, int patch_px) {
  if (order != ChannelOrder::patches) return kChannels * size.pixels();
  return int64_t{patch_values(patch_px)} * patches_along(patch_px, size.width_px) *
         patches_along(patch_px, size.height_px);
}

void check_patch_px(std::string_view renderer, ChannelOrder order, int patch_px) {
  PICTURA_CHECK(order != ChannelOrder::patches || is_drawn_patch(patch_px),
                "{}images: expected patches of 4, 8, 12 or 16 pixels squared, got {}",
                renderer.empty() ? "" : fmt::format("renderer {}: ", renderer), patch_px);
}

ImageLayout image_layout(Span<const ImageSize> sizes, int64_t num_views, PixelFormat format, ChannelOrder order,
                         int patch_px) {
  PICTURA_CHECK(num_views >= 0, "images: expected 0 views or more, got {}", num_views);
  check_patch_px("", order, patch_px);
  ImageLayout layout;
  layout.format = format;
  layout.order = order;
  layout.patch_px = patch_px;
  layout.num_views = num_views;
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    const auto block = std::find_if(layout.blocks.begin(), layout.blocks.end(),
                                    [&](const BlockLayout& each) { return each.size == sizes[i]; });
    CameraLayout camera{.size = sizes[i], .block = static_cast<int>(block - layout.blocks.begin())};
    layout.cameras.push_back(camera);
    if (block == layout.blocks.end()) layout.blocks.push_back({.size = sizes[i]});
    layout.blocks[camera.block].cameras.push_back(static_cast<int>(i));
  }
  const bool is_planar = order == ChannelOrder::planar;
  for (BlockLayout& block : layout.blocks) {
    block.offset = layout.num_values;
    const int64_t values = image_values(block.size, order, patch_px);
    for (std::size_t i = 0; i < block.cameras.size(); ++i) {
      CameraLayout& camera = layout.cameras[block.cameras[i]];
      camera.offset = block.offset + static_cast<int64_t>(i) * values;
      camera.view_stride = static_cast<int64_t>(block.cameras.size()) * values;
      camera.camera_stride = values;
      if (order == ChannelOrder::patches) continue;
      camera.channel_stride = is_planar ? block.size.pixels() : 1;
      camera.pixel_stride = is_planar ? 1 : kChannels;
      camera.row_stride = block.size.width_px * camera.pixel_stride;
    }
    layout.num_values += num_views * static_cast<int64_t>(block.cameras.size()) * values;
  }
  return layout;
}

ImageLayout image_layout(const Rig& rig, int64_t num_views, PixelFormat format, ChannelOrder order, int patch_px) {
  validate(rig);
  std::vector<ImageSize> sizes;
  for (const Camera& camera : rig.cameras) sizes.push_back({camera.width_px, camera.height_px});
  return image_layout(sizes, num_views, format, order, patch_px);
}

CameraImages camera_images(const ImageLayout& layout, int camera, void* first) {
  const CameraLayout& its = layout.cameras[camera];
  CameraImages images;
  images.width_px = its.size.width_px;
  images.height_px = its.size.height_px;
  if (first != nullptr) {  // null if there are no views
    images.data = static_cast<std::byte*>(first) + its.offset * static_cast<int64_t>(bytes_per_value(layout.format));
  }
  images.view_stride = its.view_stride;
  return images;
}

HostImages::HostImages(const Rig& rig, int num_views, PixelFormat format, Planes planes, ChannelOrder order,
                       int patch_px)
    : layout_(image_layout(rig, num_views, format, order, patch_px)), bytes_(layout_.bytes()) {
  for (int i = 0; i < static_cast<int>(layout_.cameras.size()); ++i) {
    cameras_.push_back(camera_images(layout_, i, bytes_.data()));
  }
  if (planes == Planes::none) return;
  std::size_t pixels = 0;
  auto pixels_of = [&](const CameraLayout& camera) {
    return static_cast<std::size_t>(num_views) * static_cast<std::size_t>(camera.size.pixels());
  };
  for (const CameraLayout& camera : layout_.cameras) pixels += pixels_of(camera);
  depth_m_.resize(pixels);
  class_id_.resize(pixels);
  instance_id_.resize(pixels);
  pixels = 0;
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    CameraImages& camera = cameras_[i];
    camera.depth_m = depth_m_.data() + pixels;
    camera.class_id = class_id_.data() + pixels;
    camera.instance_id = instance_id_.data() + pixels;
    pixels += pixels_of(layout_.cameras[i]);
  }
}

ImageBatch HostImages::batch() {
  return {Device{}, layout_.format, static_cast<int>(layout_.num_views), cameras_, layout_.order, layout_.patch_px};
}

std::vector<uint8_t> HostImages::interleaved(int view, int camera_index) const {
  PICTURA_CHECK(layout_.format == PixelFormat::u8 && layout_.order == ChannelOrder::planar,
                "images: expected planar images of the format u8");
  const CameraLayout& from = layout_.cameras[camera_index];
  const ImageLayout one =
      image_layout(Span<const ImageSize>(&from.size, 1), 1, PixelFormat::u8, ChannelOrder::interleaved);
  const CameraLayout& to = one.cameras[0];
  const uint8_t* const image = bytes_.data() + from.offset + view * from.view_stride;
  std::vector<uint8_t> rgb(one.bytes());
  for (int y = 0; y < from.size.height_px; ++y) {
    for (int x = 0; x < from.size.width_px; ++x) {
      for (int channel = 0; channel < 3; ++channel) {
        rgb[y * to.row_stride + x * to.pixel_stride + channel * to.channel_stride] =
            image[y * from.row_stride + x * from.pixel_stride + channel * from.channel_stride];
      }
    }
  }
  return rgb;
}

namespace {

// State that libpng's callbacks can reach. The callbacks are C functions: they report errors by longjmp, and exceptions
// must not pass through them.
struct PngOutput {
  std::string bytes, complaint;
};

void append_png_bytes(png_structp png, png_bytep data, std::size_t size) {
  auto* output = static_cast<PngOutput*>(png_get_io_ptr(png));
  bool has_room = true;
  try {
    output->bytes.append(reinterpret_cast<const char*>(data), size);
  } catch (const std::bad_alloc&) {
    has_room = false;
  }
  if (!has_room) png_error(png, "out of memory");
}

void keep_png_complaint(png_structp png, png_const_charp message) {
  auto* output = static_cast<PngOutput*>(png_get_error_ptr(png));
  try {
    output->complaint = message;
  } catch (const std::bad_alloc&) {
    output->complaint.clear();
  }
  png_longjmp(png, 1);
}

void ignore_png_warning(png_structp, png_const_charp) {}

// Encoder of a PNG, row by row.
class PngEncoder {
 public:
  PngEncoder()
      : png_(png_create_write_struct(PNG_LIBPNG_VER_STRING, &output_, keep_png_complaint, ignore_png_warning)),
        info_(png_ ? png_create_info_struct(png_) : nullptr) {}
  ~PngEncoder() { png_destroy_write_struct(&png_, &info_); }
  PngEncoder(const PngEncoder&) = delete;
  PngEncoder& operator=(const PngEncoder&) = delete;

  bool begin(int width_px, int height_px) {
    if (!info_ || setjmp(png_jmpbuf(png_))) return false;
    png_set_write_fn(png_, &output_, append_png_bytes, nullptr);
    png_set_IHDR(png_, info_, static_cast<png_uint_32>(width_px), static_cast<png_uint_32>(height_px), 8,
                 PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_sRGB(png_, info_, PNG_sRGB_INTENT_PERCEPTUAL);
    png_write_info(png_, info_);
    return true;
  }
  bool add_row(const uint8_t* rgb) {
    if (setjmp(png_jmpbuf(png_))) return false;
    png_write_row(png_, rgb);
    return true;
  }
  bool end() {
    if (setjmp(png_jmpbuf(png_))) return false;
    png_write_end(png_, info_);
    return true;
  }
  /// Returns the bytes that were encoded since the last call.
  std::string take() { return std::exchange(output_.bytes, {}); }
  const std::string& complaint() const { return output_.complaint; }

 private:
  PngOutput output_;
  png_structp png_;
  png_infop info_;
};

}  // namespace

void write_png(const std::string& path, int width_px, int height_px, Span<const uint8_t> rgb) {
  PICTURA_CHECK(
      width_px > 0 && height_px > 0 &&
          rgb.size() == std::size_t{3} * static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px),
      "{}: expected {}x{} RGB pixels, got {} bytes", path, width_px, height_px, rgb.size());
  const InterruptibleWork work(fmt::format("{}: interrupted while it was written", path));
  OutputFile out(path);
  PngEncoder encoder;
  const auto check = [&](bool encoded) {
    PICTURA_CHECK(encoded, "{}: cannot be written: {}", path,
                  encoder.complaint().empty() ? "out of memory" : encoder.complaint());
    out.write(encoder.take());
  };
  check(encoder.begin(width_px, height_px));
  for (int y = 0; y < height_px; ++y) {
    work.check();
    check(encoder.add_row(rgb.data() +
                          std::size_t{3} * static_cast<std::size_t>(width_px) * static_cast<std::size_t>(y)));
  }
  check(encoder.end());
  out.commit();
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
