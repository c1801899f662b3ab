// Batches of images. ImageBatch refers to memory of the caller, and HostImages owns host memory. Only image_layout()
// computes where images are in memory. There are no gaps between or within images, except that patches may extend
// beyond an image.
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

/// Bytes of one channel of one pixel.
std::size_t bytes_per_value(PixelFormat format);

std::string_view name_of(ChannelOrder order);

struct ImageSize {
  int width_px = 0, height_px = 0;
  bool operator==(const ImageSize&) const = default;
  int64_t pixels() const { return int64_t{width_px} * height_px; }
};
/// Number of values (channels of pixels) of one image. If the order is patches, it includes the padding of patches with
/// side `patch_px`.
int64_t image_values(ImageSize size, ChannelOrder order, int patch_px = kDefaultPatch_px);
/// Throws Error if the order is patches and renderers cannot write patches of this side. The message begins with the
/// renderer's name unless `renderer` is empty. Allocates memory only for the message.
void check_patch_px(std::string_view renderer, ChannelOrder order, int patch_px);

/// Place of one camera's images in the memory of an ImageLayout. Offsets and strides count values (channels of pixels).
/// The index of channel c of pixel (x, y) of a view is offset + view * view_stride + c * channel_stride + y *
/// row_stride + x * pixel_stride. If the order is patches, the index is offset + view * view_stride +
/// place_in_patches(patch_px, width, c, x, y), and the last three strides are 0.
struct CameraLayout {
  ImageSize size;
  int block = 0;  // index into ImageLayout::blocks
  int64_t offset = 0;
  int64_t view_stride = 0, camera_stride = 0, channel_stride = 0, row_stride = 0, pixel_stride = 0;
};
/// Block of images of one size, as an array [views, cameras of the block, ...]. The last dimensions are those of the
/// image's ChannelOrder.
struct BlockLayout {
  ImageSize size;
  std::vector<int> cameras;  // indices into the rig's cameras, ascending
  int64_t offset = 0;        // in values
};
struct ImageLayout {
  std::vector<CameraLayout> cameras;  // [cameras of the rig]
  std::vector<BlockLayout> blocks;    // one per distinct size, without gaps, in order of first occurrence
  PixelFormat format = PixelFormat::u8;
  ChannelOrder order = ChannelOrder::planar;
  int patch_px = kDefaultPatch_px;  // side of the patches if the order is patches
  int64_t num_views = 0, num_values = 0;
  std::size_t bytes() const { return static_cast<std::size_t>(num_values) * bytes_per_value(format); }
};

/// Computes the layout of images. Throws Error if num_views is negative, or if the order is patches and patch_px is not
/// 4, 8, 12 or 16.
ImageLayout image_layout(Span<const ImageSize> sizes, int64_t num_views, PixelFormat format,
                         ChannelOrder order = ChannelOrder::planar, int patch_px = kDefaultPatch_px);
/// Computes the layout of the images of a rig. Also throws the errors of validate(rig).
ImageLayout image_layout(const Rig& rig, int64_t num_views, PixelFormat format,
                         ChannelOrder order = ChannelOrder::planar, int patch_px = kDefaultPatch_px);

/// Memory of one camera's images, without gaps within an image. In planar images, channel `channel` of pixel (x, y) is
/// element view * view_stride + (channel * height + y) * width + x of `data`. In patches, it is element view *
/// view_stride + place_in_patches(patch_px, width, channel, x, y).
struct CameraImages {
  int width_px = 0, height_px = 0;
  void* data = nullptr;             // colour in ImageBatch::format
  int64_t view_stride = 0;          // elements from one view's image to the next
  float* depth_m = nullptr;         // optional, [views, height, width]; infinity at pixels without a surface
  uint8_t* class_id = nullptr;      // optional, class of the front surface at the pixel centre; 0: none
  uint16_t* instance_id = nullptr;  // optional, 1 + index of the agent in its world; 0: none
};

/// Returns one camera's images in the memory that begins at `first` and has the given layout. The optional pointers are
/// null.
CameraImages camera_images(const ImageLayout& layout, int camera, void* first);

/// Images that Renderer::render() fills. All renderers draw planar images. Renderers whose draws_all_formats() is true
/// also draw patches of 4, 8, 12 or 16 px. Renderers throw Error for other requests.
struct ImageBatch {
  Device device;  // device of all spans and pointers below
  PixelFormat format = PixelFormat::u8;
  int num_views = 0;
  Span<const CameraImages> cameras;  // [cameras of the rig]
  ChannelOrder order = ChannelOrder::planar;
  int patch_px = kDefaultPatch_px;  // side of the patches if the order is patches
};

enum class Planes : uint8_t { none, all };  // optional outputs of CameraImages: depth, class and instance

/// Host memory for the images of a rig. image_layout() defines the layout of the colour.
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
  /// Bytes of all colour blocks in order.
  Span<const uint8_t> bytes() const { return bytes_; }
  Span<uint8_t> bytes() { return bytes_; }
  const CameraImages& camera(int index) const { return cameras_[index]; }
  /// Returns u8 colour of one image as [height, width, 3]. Throws Error unless the format is u8 and the order planar.
  std::vector<uint8_t> interleaved(int view, int camera) const;

 private:
  ImageLayout layout_;
  std::vector<uint8_t> bytes_;
  std::vector<float> depth_m_;  // [cameras][views, height, width], or empty
  std::vector<uint8_t> class_id_;
  std::vector<uint16_t> instance_id_;
  std::vector<CameraImages> cameras_;
};

/// Writes an 8-bit RGB image, [height, width, 3], as PNG, completely or not at all. Throws Error naming the path, and
/// Interrupted at ^C.
void write_png(const std::string& path, int width_px, int height_px, Span<const uint8_t> rgb);
struct RgbImage {
  int width_px = 0, height_px = 0;
  std::vector<uint8_t> rgb;  // [height, width, 3]
};
/// Reads any PNG as 8-bit RGB. Throws Error naming the path.
RgbImage read_png(const std::string& path);

}  // namespace pictura
