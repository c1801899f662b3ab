// Batches of images, without gaps between or within images. Only image_layout() decides where images are in memory.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "pictura/common/camera.h"
#include "pictura/common/color.h"
#include "pictura/common/device.h"
#include "pictura/common/error_types.h"
#include "pictura/common/patches.h"
#include "pictura/common/span.h"

namespace pictura {

std::size_t bytes_per_value(PixelFormat format);

std::string_view name_of(ChannelOrder order);

struct ImageSize {
  int width_px = 0, height_px = 0;
  bool operator==(const ImageSize&) const = default;
  int64_t pixels() const { return int64_t{width_px} * height_px; }
};
/// Number of values (channels of pixels) of one image, including the padding of patches.
int64_t image_values(ImageSize size, ChannelOrder order, int patch_px = kDefaultPatch_px);
/// Throws Error if the order is patches and renderers cannot write patches with sides of patch_px. The message begins
/// with `renderer`, which may be empty.
void check_patch_px(std::string_view renderer, ChannelOrder order, int patch_px);

/// Place of one camera's images in an ImageLayout, in values (channels of pixels). Channel c of pixel (x, y) is at
/// offset + view * view_stride + c * channel_stride + y * row_stride + x * pixel_stride. In patches, it is at offset +
/// view * view_stride + place_in_patches(patch_px, width, c, x, y), and the last three strides are 0.
struct CameraLayout {
  ImageSize size;
  int block = 0;  // index into ImageLayout::blocks
  int64_t offset = 0;
  int64_t view_stride = 0, camera_stride = 0, channel_stride = 0, row_stride = 0, pixel_stride = 0;
};
/// Images of one size: an array [views, cameras of the block, ...].
struct BlockLayout {
  ImageSize size;
  std::vector<int> cameras;  // indices in the rig, ascending
  int64_t offset = 0;        // in values
};
struct ImageLayout {
  std::vector<CameraLayout> cameras;
  std::vector<BlockLayout> blocks;  // one per distinct size, in order of first occurrence
  PixelFormat format = PixelFormat::u8;
  ChannelOrder order = ChannelOrder::planar;
  int patch_px = kDefaultPatch_px;  // only for patches
  int64_t num_views = 0, num_values = 0;
  std::size_t bytes() const { return static_cast<std::size_t>(num_values) * bytes_per_value(format); }
};

/// Computes the layout of images. Throws Error if num_views is negative, or if the order is patches and patch_px is not
/// 4, 8, 12 or 16.
ImageLayout image_layout(Span<const ImageSize> sizes, int64_t num_views, PixelFormat format,
                         ChannelOrder order = ChannelOrder::planar, int patch_px = kDefaultPatch_px);
/// Also throws the errors of validate(rig).
ImageLayout image_layout(const Rig& rig, int64_t num_views, PixelFormat format,
                         ChannelOrder order = ChannelOrder::planar, int patch_px = kDefaultPatch_px);

/// Memory of one camera's images. The image of view v begins at element v * view_stride of `data`, in the layout of
/// ImageBatch::order.
struct CameraImages {
  int width_px = 0, height_px = 0;
  void* data = nullptr;             // in ImageBatch::format
  int64_t view_stride = 0;          // in elements
  float* depth_m = nullptr;         // optional, [views, height, width]; infinity without a surface
  uint8_t* class_id = nullptr;      // optional, SurfaceClass at the pixel centre; 0: no surface
  uint16_t* instance_id = nullptr;  // optional, 1 + the agent's index in its world; 0: no agent
};

/// Returns one camera's images in memory that begins at `first`. Optional pointers are null.
CameraImages camera_images(const ImageLayout& layout, int camera, void* first);

/// Images that Renderer::render() fills. Renderers throw Error for formats and orders that they do not draw, see
/// Renderer::draws_all_formats().
struct ImageBatch {
  Device device;  // device of all pointers below
  PixelFormat format = PixelFormat::u8;
  int num_views = 0;
  Span<const CameraImages> cameras;  // [cameras of the rig]
  ChannelOrder order = ChannelOrder::planar;
  int patch_px = kDefaultPatch_px;  // only for patches
};

enum class Planes : uint8_t { none, all };  // optional planes of CameraImages

/// Host memory for the images of a rig, in the layout of image_layout().
class HostImages {
 public:
  HostImages(const Rig& rig, int num_views, PixelFormat format = PixelFormat::u8, Planes planes = Planes::none,
             ChannelOrder order = ChannelOrder::planar, int patch_px = kDefaultPatch_px);
  // Not copyable, because a copy's cameras would point into the original's memory.
  HostImages(const HostImages&) = delete;
  HostImages& operator=(const HostImages&) = delete;
  HostImages(HostImages&&) = default;
  HostImages& operator=(HostImages&&) = default;
  ImageBatch batch();
  const ImageLayout& layout() const { return layout_; }
  Span<const uint8_t> bytes() const { return bytes_; }
  Span<uint8_t> bytes() { return bytes_; }
  const CameraImages& camera(int index) const { return cameras_[index]; }
  /// Returns one image's colour as [height, width, 3]. Throws Error unless the format is u8 and the order planar.
  std::vector<uint8_t> interleaved(int view, int camera) const;

 private:
  ImageLayout layout_;
  std::vector<uint8_t> bytes_;
  std::vector<float> depth_m_;  // [cameras][views, height, width], or empty
  std::vector<uint8_t> class_id_;
  std::vector<uint16_t> instance_id_;
  std::vector<CameraImages> cameras_;
};

/// Writes [height, width, 3] as PNG, completely or not at all. Throws Error naming the path, and Interrupted at ^C.
void write_png(const std::string& path, int width_px, int height_px, Span<const uint8_t> rgb);
struct RgbImage {
  int width_px = 0, height_px = 0;
  std::vector<uint8_t> rgb;  // [height, width, 3]
};
/// Reads any PNG. Throws Error naming the path.
RgbImage read_png(const std::string& path);

}  // namespace pictura
