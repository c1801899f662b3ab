// Occlusion by solids in eight pixels (x, y) to (x + 7, y) in parallel (SIMD), by the rules of
// common/raster/visibility.h.
#pragma once

#include "pictura/backend_cpu/renderer/fast/vectors_x8.h"
#include "pictura/common/raster/visibility.h"

namespace pictura {

inline Float8 center_inverse_depth_x8(const ScreenFace& face, int x, int y) {
  const Float8 x_px = lane_numbers() + static_cast<float>(x) + 0.5f;
  const Float8 inverse_depth =
      face.inverse_depth_0 + face.inverse_depth_x * x_px + face.inverse_depth_y * (static_cast<float>(y) + 0.5f);
  return min_no_nan(max_no_nan(inverse_depth, face.inverse_depth_low), face.inverse_depth_high);
}

inline Float8 occluder_bound_x8(const ScreenFace& face, int x, int y) {
  const Float8 lowest =
      max_no_nan(center_inverse_depth_x8(face, x, y) - inverse_depth_half_range(face), face.inverse_depth_low);
  constexpr float kLower = 1.0f - 2.0f * kEqualDepth;
  constexpr uint32_t kBits = ~((1u << (32 - kOccluderBoundBits)) - 1);
  return keep_bits(lowest * kLower, kBits);
}

/// Raises the bounds left of x_end to at least a solid's occluder_bound().
inline void raise_occluder_bounds_x8(const ScreenFace& face, int x, int x_end, int y, float* bounds_inout) {
  const Float8 before = load8(bounds_inout), bound = max_no_nan(before, occluder_bound_x8(face, x, y));
  store8(select(lane_numbers() < static_cast<float>(x_end - x), bound, before), bounds_inout);
}

/// Bit mask of the pixels that pass passes_occluder_bound().
inline unsigned passes_occluder_bound_x8(const ScreenFace& face, const float* bounds, int x, int y) {
  const Float8 nearest = center_inverse_depth_x8(face, x, y) + inverse_depth_half_range(face);
  return ~bits_of(nearest * face.nearest_standing < load8(bounds));
}

}  // namespace pictura
