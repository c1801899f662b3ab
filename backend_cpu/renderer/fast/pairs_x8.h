// Order of eight pairs of fragments in parallel (SIMD), by the rules of common/raster/visibility.h.
#pragma once

#include <cstddef>

#include "pictura/backend_cpu/renderer/fast/vectors_x8.h"
#include "pictura/common/raster/visibility.h"

namespace pictura {

struct PairsX8 {
  const ScreenFace* a[kLanes];
  const ScreenFace* b[kLanes];
  alignas(32) uint64_t shared[kLanes];  // see shared_samples(); not 0
  alignas(32) float x[kLanes];          // corners of the pixels
  alignas(32) float y[kLanes];
};

/// Version of centroid_of() for eight masks, none of which is 0.
inline Vec2x8 centroid_of_x8(const uint64_t* samples) {
  int32_t count[kLanes], columns[kLanes], rows[kLanes], offsets[kLanes];
  for (int lane = 0; lane < kLanes; ++lane) {
    const SampleSums sums = sums_of(samples[lane]);
    count[lane] = popcount(samples[lane]);
    columns[lane] = sums.columns;
    rows[lane] = sums.rows;
    offsets[lane] = sums.offsets;
  }
  const Float8 n = load8_integers(count);
  return {(load8_integers(columns) + 0.5f * n) / (8.0f * n),
          (load8_integers(rows) + (load8_integers(offsets) + 0.5f * n) / 8.0f) / (8.0f * n)};
}

struct FacesX8 {
  Float8 inverse_depth_x, inverse_depth_y, inverse_depth_0, inverse_depth_low, inverse_depth_high, plane_distance_m;
  Float8 object_id;  // as the bits of a float

  explicit FacesX8(const ScreenFace* const* face) {
    Float8 from_x[4], from_low[4];
    load_four<offsetof(ScreenFace, inverse_depth_x)>(face, from_x);
    load_four<offsetof(ScreenFace, inverse_depth_low)>(face, from_low);
    inverse_depth_x = from_x[0];
    inverse_depth_y = from_x[1];
    inverse_depth_0 = from_x[2];
    object_id = from_x[3];
    inverse_depth_low = from_low[0];
    inverse_depth_high = from_low[1];
    plane_distance_m = from_low[3];
  }
  Float8 inverse_depth(const Vec2x8& at_px) const {
    return inverse_depth_0 + inverse_depth_x * at_px.x + inverse_depth_y * at_px.y;
  }
  Mask8 are_strips() const { return ~less_bits(object_id, float_from_bits(kStripKind << kKindShift)); }

 private:
  // Loads four members of each face from kOffset on.
  template <std::size_t kOffset>
  static void load_four(const ScreenFace* const* face, Float8* members_out) {
    static_assert(offsetof(ScreenFace, object_id) == offsetof(ScreenFace, inverse_depth_x) + 3 * sizeof(float));
    static_assert(offsetof(ScreenFace, plane_distance_m) ==
                  offsetof(ScreenFace, inverse_depth_low) + 3 * sizeof(float));
    gather_fours([face](int lane) -> const void* { return reinterpret_cast<const char*>(face[lane]) + kOffset; },
                 members_out);
  }
};

/// Order of eight pairs, as bit masks of lanes. a_first: a is in front of b at all shared samples. undecided:
/// occlude_pair() must decide.
struct PairOrder {
  unsigned a_first = 0, undecided = 0;
};
inline PairOrder order_pairs(const PairsX8& pairs) {
  const FacesX8 a(pairs.a), b(pairs.b);
  const Vec2x8 at = Vec2x8{load8(pairs.x), load8(pairs.y)} + centroid_of_x8(pairs.shared);
  const Float8 inverse_depth_a = a.inverse_depth(at), inverse_depth_b = b.inverse_depth(at);
  const Mask8 strip_a = a.are_strips(), strip_b = b.are_strips(), lower_id = less_bits(a.object_id, b.object_id),
              of_one_primitive = equal_bits(a.object_id, b.object_id);

  // samples_in_front()
  const Float8 distance = inverse_depth_a - inverse_depth_b;
  const Float8 lead =
      select(lower_id, distance, -distance) + kEqualDepth * max_no_nan(inverse_depth_a, inverse_depth_b);
  const Mask8 change_places = (magnitude(lead) < magnitude(a.inverse_depth_x - b.inverse_depth_x) +
                                                     magnitude(a.inverse_depth_y - b.inverse_depth_y)) &
                              ~strip_a & ~strip_b;

  // is_in_front()
  auto clamped = [](Float8 x, const FacesX8& face) {
    return min_no_nan(max_no_nan(x, face.inverse_depth_low), face.inverse_depth_high);
  };
  const Float8 clamped_a = clamped(inverse_depth_a, a), clamped_b = clamped(inverse_depth_b, b);
  const Float8 nearest = max_no_nan(clamped_a, clamped_b);
  const Float8 above_a = (inverse_depth_a - nearest) * a.plane_distance_m;
  const Float8 above_b = (inverse_depth_b - nearest) * b.plane_distance_m;
  const Mask8 of_one_level = strip_a & strip_b & (magnitude(above_a - above_b) < kSameLevel_m * nearest);
  const Mask8 by_id = of_one_level | (magnitude(clamped_a - clamped_b) < kEqualDepth * nearest);
  const Mask8 a_first = (by_id & lower_id) | (~by_id & (clamped_a > clamped_b));
  const Mask8 is_strip_first = ~(a_first ^ strip_a);
  const Mask8 is_from_below = select(strip_a, a.plane_distance_m, b.plane_distance_m) > 0.0f;
  const Mask8 may_stand = (strip_a ^ strip_b) & (is_strip_first ^ is_from_below);
  return {bits_of(a_first), bits_of(of_one_primitive | change_places | may_stand)};
}

}  // namespace pictura
