// Occlusion by solids in eight pixels of a row at once: the rules of common/raster/visibility.h.
#pragma once

#include "pictura/backend_cpu/renderer/fast/float8.h"
#include "pictura/common/raster/visibility.h"

namespace pictura {

/// center_inverse_depth() in the pixels from (x, y) on.
inline Float8 center_inverse_depth_x8(const ScreenFace& face, int x, int y) {
  const Float8 x_px = Float8(kLaneNumbers) + static_cast<float>(x) + 0.5f;
  const Float8 inverse_depth =
      face.inverse_depth_0 + face.inverse_depth_x * x_px + face.inverse_depth_y * (static_cast<float>(y) + 0.5f);
  return min_no_nan(max_no_nan(inverse_depth, face.inverse_depth_low), face.inverse_depth_high);
}

/// occluder_bound() of a solid in the pixels from (x, y) on.
inline Float8 occluder_bound_x8(const ScreenFace& face, int x, int y) {
  const Float8 lowest =
      max_no_nan(center_inverse_depth_x8(face, x, y) - inverse_depth_half_range(face), face.inverse_depth_low);
  constexpr float kLower = 1.0f - 2.0f * kEqualDepth;
  constexpr uint32_t kBits = ~((1u << (32 - kOccluderBoundBits)) - 1);
  return reinterpret_cast<FloatVector>(reinterpret_cast<IntVector>((lowest * kLower).of_lane) &
                                       static_cast<int32_t>(kBits));
}

/// The lanes of the pixels from (x, y) on in which passes_occluder_bound() is true.
inline unsigned passes_occluder_bound_x8(const ScreenFace& face, Float8 bound, int x, int y) {
  const Float8 nearest = center_inverse_depth_x8(face, x, y) + inverse_depth_half_range(face);
  return ~lanes_of(nearest * face.nearest_standing < bound);
}

}  // namespace pictura
