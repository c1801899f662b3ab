#include "pictura/bench/image_error.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "pictura/bench/truth/image_truth.h"
#include "pictura/bench/truth/tolerances.h"
#include "pictura/common/portable/intrinsics.h"

namespace pictura {

namespace {

constexpr double kRounding = 1e-6;

double half_to_number(uint16_t half) {
  const int exponent = half >> 10 & 31, mantissa = half & 1023;
  if (exponent == 31) return std::numeric_limits<double>::quiet_NaN();  // infinity is treated as NaN
  const double size = exponent > 0 ? std::ldexp(1024 + mantissa, exponent - 25) : std::ldexp(mantissa, -24);
  return half >> 15 ? -size : size;
}

double channel_at(const CameraImages& images, PixelFormat format, int64_t element) {
  switch (format) {
    case PixelFormat::u8: return static_cast<const uint8_t*>(images.data)[element] / 255.0;
    case PixelFormat::f16: return half_to_number(static_cast<const uint16_t*>(images.data)[element]);
    case PixelFormat::bf16:
      return float_from_bits(uint32_t{static_cast<const uint16_t*>(images.data)[element]} << 16) / 255.0;
    default: return static_cast<double>(static_cast<const float*>(images.data)[element]);
  }
}

}  // namespace

void ImageError::add(const ImageError& other) {
  values += other.values;
  differing += other.differing;
  beyond += other.beyond;
  worst = std::max(worst, other.worst);
  plane_pixels += other.plane_pixels;
  differing_plane_pixels += other.differing_plane_pixels;
}

bool ImageError::is_within_tolerance() const {
  constexpr double kShareBeyond = 1 - kKernelShareWithin;
  return worst <= kKernelWorstError + kRounding &&
         static_cast<double>(beyond) <= kShareBeyond * static_cast<double>(values) &&
         static_cast<double>(differing_plane_pixels) <= kShareBeyond * static_cast<double>(plane_pixels);
}

ImageError compare_image(const CameraImages& actual, const CameraImages& expected, PixelFormat format, int view,
                         ChannelOrder order, int patch_px) {
  ImageError error;
  const ImageSize size{expected.width_px, expected.height_px};
  error.values = image_values(size, order, patch_px);
  for (int64_t i = 0; i < error.values; ++i) {
    const double off = value_error(channel_at(actual, format, view * actual.view_stride + i),
                                   channel_at(expected, format, view * expected.view_stride + i));
    error.worst = std::max(error.worst, off);
    error.differing += off > 0 ? 1 : 0;
    error.beyond += off > kKernelError + kRounding ? 1 : 0;
  }
  if (!expected.depth_m) return error;
  error.plane_pixels = size.pixels();
  for (int64_t i = view * error.plane_pixels; i < (view + 1) * error.plane_pixels; ++i) {
    const bool is_same = actual.class_id[i] == expected.class_id[i] &&
                         actual.instance_id[i] == expected.instance_id[i] &&
                         is_same_depth(actual.depth_m[i], expected.depth_m[i]);
    error.differing_plane_pixels += is_same ? 0 : 1;
  }
  return error;
}

void fill_unwritten(const ImageBatch& images) {
  visit_memory(images, [](void* first, std::size_t stride_bytes, std::size_t row_bytes, std::size_t rows) {
    for (std::size_t row = 0; row < rows; ++row) {
      std::memset(static_cast<uint8_t*>(first) + row * stride_bytes, kUnwrittenByte, row_bytes);
    }
  });
}

}  // namespace pictura
