// Batches of images in memory that somebody else owns (ImageBatch) and an owner for the host (HostImages). Colour is
// planar, [views, cameras, 3, height, width] for each distinct camera size of the rig; nothing is padded.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pictura/common/camera.h"
#include "pictura/common/color.h"
#include "pictura/common/device.h"
#include "pictura/common/span.h"

namespace pictura {

/// Size of one channel of one pixel.
std::size_t bytes_per_value(PixelFormat format);

/// Where one camera's images lie: pixel (view, channel, y, x) is element
/// view * view_stride + (channel * height + y) * width + x of `data`.
struct CameraImages {
  int width_px = 0, height_px = 0;
  void* data = nullptr;             // colour, of ImageBatch::format
  int64_t view_stride = 0;          // elements from one view's image to the next
  float* depth_m = nullptr;         // optional [views, height, width]; infinity where nothing is
  uint8_t* class_id = nullptr;      // optional, class of the front surface at the pixel centre; 0 nothing
  uint16_t* instance_id = nullptr;  // optional, 1 + index of the agent in its world; 0 none
};

/// What render() fills.
struct ImageBatch {
  Device device;  // of all that follows
  PixelFormat format = PixelFormat::u8;
  int num_views = 0;
  Span<const CameraImages> cameras;  // [cameras of the rig]
};

enum class Planes : uint8_t { none, all };  // depth, class and instance

/// Host memory for the images of a rig. Colour: one block per distinct size, in the order of first appearance.
class HostImages {
 public:
  HostImages(const Rig& rig, int num_views, PixelFormat format = PixelFormat::u8, Planes planes = Planes::none);
  // A copy's cameras would point into the original's memory.
  HostImages(const HostImages&) = delete;
  HostImages& operator=(const HostImages&) = delete;
  HostImages(HostImages&&) = default;
  HostImages& operator=(HostImages&&) = default;
  ImageBatch batch();
  /// The bytes of all blocks of colour in order: what image_hash is taken over.
  Span<const uint8_t> bytes() const { return bytes_; }
  Span<uint8_t> bytes() { return bytes_; }
  const CameraImages& camera(int index) const { return cameras_[static_cast<size_t>(index)]; }
  /// u8 colour of one image as interleaved rows, [height, width, 3]. Throws unless the format is u8.
  std::vector<uint8_t> interleaved(int view, int camera) const;

 private:
  PixelFormat format_;
  int num_views_;
  std::vector<uint8_t> bytes_;
  std::vector<float> depth_m_;  // of each plane [cameras][views, height, width], or empty
  std::vector<uint8_t> class_id_;
  std::vector<uint16_t> instance_id_;
  std::vector<CameraImages> cameras_;
};

/// Writes an 8-bit RGB image, rows interleaved [height, width, 3], as PNG: beside, then renamed. Throws Error naming
/// the path.
void write_png(const std::string& path, int width_px, int height_px, Span<const uint8_t> rgb);
struct RgbImage {
  int width_px = 0, height_px = 0;
  std::vector<uint8_t> rgb;  // [height, width, 3]
};
/// Reads any PNG as 8-bit RGB. Throws Error naming the path.
RgbImage read_png(const std::string& path);

}  // namespace pictura
