// Differences between images and the images of the oracle (the CPU renderer).
#pragma once

#include <cstddef>

#include "pictura/common/image.h"

namespace pictura {

/// Errors of channel values in [0, 1].
struct ImageError {
  int64_t values = 0, differing = 0;
  int64_t beyond = 0;  // errors above kKernelError
  double worst = 0;
  // Pixels with planes, and pixels whose planes show different surfaces.
  int64_t plane_pixels = 0, differing_plane_pixels = 0;

  void add(const ImageError& other);
  /// Whether the errors are within the CUDA renderer's tolerance (bench/truth/tolerances.h).
  bool is_within_tolerance() const;
};

/// Compares one camera's image of one view, and its planes. Images must have the same format, size and order.
ImageError compare_image(const CameraImages& actual, const CameraImages& expected, PixelFormat format, int view,
                         ChannelOrder order = ChannelOrder::planar, int patch_px = kDefaultPatch_px);

/// Byte that fills images before drawing, to find unwritten values.
constexpr int kUnwrittenByte = 0x7F;

/// Calls visit(first byte, bytes from row to row, bytes of a row, number of rows) for colours and planes.
template <typename Visit>
void visit_memory(const ImageBatch& images, Visit&& visit) {
  const auto views = static_cast<std::size_t>(images.num_views);
  for (const CameraImages& camera : images.cameras) {
    const auto pixels = static_cast<std::size_t>(camera.width_px) * static_cast<std::size_t>(camera.height_px);
    const std::size_t value_bytes = bytes_per_value(images.format);
    const int64_t values = image_values({camera.width_px, camera.height_px}, images.order, images.patch_px);
    visit(camera.data, static_cast<std::size_t>(camera.view_stride) * value_bytes,
          static_cast<std::size_t>(values) * value_bytes, views);
    auto visit_plane = [&](auto* plane) {
      if (plane) visit(static_cast<void*>(plane), pixels * sizeof *plane, pixels * sizeof *plane, views);
    };
    visit_plane(camera.depth_m);
    visit_plane(camera.class_id);
    visit_plane(camera.instance_id);
  }
}

void fill_unwritten(const ImageBatch& images);

}  // namespace pictura
