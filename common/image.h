// Batches of images in memory that somebody else owns (ImageBatch), an owner for the host (HostImages), and the one
// place that computes where images lie (image_layout). Nothing is padded.
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

/// Size of one channel of one pixel.
std::size_t bytes_per_value(PixelFormat format);

std::string_view name_of(ChannelOrder order);

struct ImageSize {
  int width_px = 0, height_px = 0;
  bool operator==(const ImageSize&) const = default;
  int64_t pixels() const { return int64_t{width_px} * height_px; }
};
/// How many values one image of this size has: channels of pixels, and what patches of `patch_px` add to them.
int64_t image_values(ImageSize size, ChannelOrder order, int patch_px = kDefaultPatch_px);
/// Throws Error, which begins with the renderer's name if there is one, unless renderers write patches of this side, or
/// the order is another. Allocates nothing else.
void check_patch_px(std::string_view renderer, ChannelOrder order, int patch_px);

/// Where one camera's images lie in the memory of a layout. Channel c of pixel (x, y) of a view is the value
/// offset + view * view_stride + c * channel_stride + y * row_stride + x * pixel_stride; all of these count values. In
/// patches it is offset + view * view_stride + place_in_patches(patch_px, width, c, x, y), and the last three are 0.
struct CameraLayout {
  ImageSize size;
  int block = 0;  // index into ImageLayout::blocks
  int64_t offset = 0;
  int64_t view_stride = 0, camera_stride = 0, channel_stride = 0, row_stride = 0, pixel_stride = 0;
};
/// Images of one size: [views, cameras of the block, channels, rows, pixels], or with the channels last.
struct BlockLayout {
  ImageSize size;
  std::vector<int> cameras;  // of the rig, in ascending order
  int64_t offset = 0;        // in values
};
struct ImageLayout {
  std::vector<CameraLayout> cameras;  // [cameras of the rig]
  std::vector<BlockLayout> blocks;    // one per distinct size, in the order of first appearance, without gaps
  PixelFormat format = PixelFormat::u8;
  ChannelOrder order = ChannelOrder::planar;
  int patch_px = kDefaultPatch_px;  // side of the patches, where the order is of patches
  int64_t num_views = 0, num_values = 0;
  std::size_t bytes() const { return static_cast<std::size_t>(num_values) * bytes_per_value(format); }
};

/// Throws Error unless there are 0 views or more, and patches of 4, 8, 12 or 16 px where the order is of patches.
ImageLayout image_layout(Span<const ImageSize> sizes, int64_t num_views, PixelFormat format,
                         ChannelOrder order = ChannelOrder::planar, int patch_px = kDefaultPatch_px);
/// Throws Error as validate(rig) does, too.
ImageLayout image_layout(const Rig& rig, int64_t num_views, PixelFormat format,
                         ChannelOrder order = ChannelOrder::planar, int patch_px = kDefaultPatch_px);

/// Memory of one camera's images. In planar images value (view, channel, y, x) is element
/// view * view_stride + (channel * height + y) * width + x of `data`, in patches view * view_stride +
/// place_in_patches(patch_px, width, channel, x, y): there are no gaps within.
struct CameraImages {
  int width_px = 0, height_px = 0;
  void* data = nullptr;             // colour, of ImageBatch::format
  int64_t view_stride = 0;          // elements from one view's image to the next
  float* depth_m = nullptr;         // optional [views, height, width]; infinity where nothing is drawn
  uint8_t* class_id = nullptr;      // optional, class of the front surface at the pixel centre; 0: nothing
  uint16_t* instance_id = nullptr;  // optional, 1 + index of the agent in its world; 0: no agent
};

/// A camera's images in the memory of a whole layout, without planes.
CameraImages camera_images(const ImageLayout& layout, int camera, void* first);

/// What render() fills. All renderers draw planar images, those that say so (Renderer::draws_all_formats) patches of 4,
/// 8, 12 or 16 px too; others are refused.
struct ImageBatch {
  Device device;  // of all that follows
  PixelFormat format = PixelFormat::u8;
  int num_views = 0;
  Span<const CameraImages> cameras;  // [cameras of the rig]
  ChannelOrder order = ChannelOrder::planar;
  int patch_px = kDefaultPatch_px;  // side of the patches, where the order is of patches
};

enum class Planes : uint8_t { none, all };  // depth, class and instance

/// Host memory for the images of a rig: colour as image_layout says.
class HostImages {
 public:
  HostImages(const Rig& rig, int num_views, PixelFormat format = PixelFormat::u8, Planes planes = Planes::none,
             ChannelOrder order = ChannelOrder::planar, int patch_px = kDefaultPatch_px);
  // A copy's cameras would point into the original's memory.
  HostImages(const HostImages&) = delete;
  HostImages& operator=(const HostImages&) = delete;
  HostImages(HostImages&&) = default;
  HostImages& operator=(HostImages&&) = default;
  ImageBatch batch();
  const ImageLayout& layout() const { return layout_; }
  /// The bytes of all blocks of colour in order: what image_hash is computed from.
  Span<const uint8_t> bytes() const { return bytes_; }
  Span<uint8_t> bytes() { return bytes_; }
  const CameraImages& camera(int index) const { return cameras_[index]; }
  /// u8 colour of one image as [height, width, 3]. Throws unless the format is u8 and the order planar.
  std::vector<uint8_t> interleaved(int view, int camera) const;

 private:
  ImageLayout layout_;
  std::vector<uint8_t> bytes_;
  std::vector<float> depth_m_;  // of each plane [cameras][views, height, width], or empty
  std::vector<uint8_t> class_id_;
  std::vector<uint16_t> instance_id_;
  std::vector<CameraImages> cameras_;
};

/// Writes an 8-bit RGB image, [height, width, 3], as PNG, whole or not at all. Throws Error naming the path,
/// Interrupted at ^C.
void write_png(const std::string& path, int width_px, int height_px, Span<const uint8_t> rgb);
struct RgbImage {
  int width_px = 0, height_px = 0;
  std::vector<uint8_t> rgb;  // [height, width, 3]
};
/// Reads any PNG as 8-bit RGB. Throws Error naming the path.
RgbImage read_png(const std::string& path);

}  // namespace pictura
