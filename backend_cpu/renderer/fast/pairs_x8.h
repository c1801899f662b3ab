// Order of eight pairs of fragments at once: the rules of common/raster/visibility.h.
#pragma once

#include <cstddef>

#include "pictura/backend_cpu/renderer/fast/float8.h"
#include "pictura/common/raster/visibility.h"

namespace pictura {

/// Eight pairs of fragments.
struct PairsX8 {
  const ScreenFace* a[kLanes];
  const ScreenFace* b[kLanes];
  alignas(32) uint64_t shared[kLanes];  // see shared_samples(); not 0
  alignas(32) float x[kLanes];          // the pixels' corners
  alignas(32) float y[kLanes];
};

/// centroid_of() of eight masks that are not 0.
inline Vec2x8 centroid_of_x8(const uint64_t* samples) {
#if defined(__AVX2__)
  auto twice = [](__m128i half) { return _mm256_broadcastsi128_si256(half); };
  // By half bytes, which are rows 0 to 3 or 4 to 7 of a column: their number of samples, and the sum of the rows.
  const __m256i counts_of = twice(_mm_setr_epi8(0, 1, 1, 2, 1, 2, 2, 3, 1, 2, 2, 3, 2, 3, 3, 4));
  const __m256i upper_rows_of = twice(_mm_setr_epi8(0, 0, 1, 1, 2, 2, 3, 3, 3, 3, 4, 4, 5, 5, 6, 6));
  const __m256i lower_rows_of = twice(_mm_setr_epi8(0, 4, 5, 9, 6, 10, 11, 15, 7, 11, 12, 16, 13, 17, 18, 22));
  // By bytes: the column, and its offset in eighths of a row, see sample_column_offset.
  const __m256i column_of = _mm256_set1_epi64x(0x0706050403020100);
  const __m256i offset_of = _mm256_set1_epi64x(0x0703050106020400);
  const __m256i zero = _mm256_setzero_si256(), half_byte = _mm256_set1_epi8(0x0F);
  __m256i count[2], columns[2], rows[2], offsets[2];
  for (int i = 0; i < 2; ++i) {
    const __m256i bits = _mm256_load_si256(reinterpret_cast<const __m256i*>(samples) + i);
    const __m256i upper = _mm256_and_si256(bits, half_byte);
    const __m256i lower = _mm256_and_si256(_mm256_srli_epi16(bits, 4), half_byte);
    const __m256i counts =
        _mm256_add_epi8(_mm256_shuffle_epi8(counts_of, upper), _mm256_shuffle_epi8(counts_of, lower));
    count[i] = _mm256_sad_epu8(counts, zero);
    columns[i] = _mm256_sad_epu8(_mm256_maddubs_epi16(counts, column_of), zero);
    offsets[i] = _mm256_sad_epu8(_mm256_maddubs_epi16(counts, offset_of), zero);
    rows[i] = _mm256_sad_epu8(
        _mm256_add_epi8(_mm256_shuffle_epi8(upper_rows_of, upper), _mm256_shuffle_epi8(lower_rows_of, lower)), zero);
  }
  auto floats_of = [](const __m256i* sums) {
    const __m256 low_halves = _mm256_shuffle_ps(_mm256_castsi256_ps(sums[0]), _mm256_castsi256_ps(sums[1]), 0x88);
    const __m256i in_order = _mm256_permute4x64_epi64(_mm256_castps_si256(low_halves), 0xD8);
    return Float8(reinterpret_cast<FloatVector>(_mm256_cvtepi32_ps(in_order)));
  };
  const Float8 n = floats_of(count);
  return {(floats_of(columns) + 0.5f * n) / (8.0f * n),
          (floats_of(rows) + (floats_of(offsets) + 0.5f * n) / 8.0f) / (8.0f * n)};
#else
  Vec2x8 result;
  for (int lane = 0; lane < kLanes; ++lane) {
    const Vec2 centroid = centroid_of(samples[lane]);
    result.x.of_lane[lane] = centroid.x;
    result.y.of_lane[lane] = centroid.y;
  }
  return result;
#endif
}

/// What decides the order of eight faces.
struct FacesX8 {
  Float8 inverse_depth_x, inverse_depth_y, inverse_depth_0, inverse_depth_low, inverse_depth_high, plane_distance_m;
  UintVector object_id;

  explicit FacesX8(const ScreenFace* const* face) {
    Float8 from_x[4], from_low[4];
    load_four<offsetof(ScreenFace, inverse_depth_x)>(face, from_x);
    load_four<offsetof(ScreenFace, inverse_depth_low)>(face, from_low);
    inverse_depth_x = from_x[0];
    inverse_depth_y = from_x[1];
    inverse_depth_0 = from_x[2];
    object_id = reinterpret_cast<UintVector>(from_x[3].of_lane);
    inverse_depth_low = from_low[0];
    inverse_depth_high = from_low[1];
    plane_distance_m = from_low[3];
  }
  Float8 inverse_depth(const Vec2x8& at_px) const {
    return inverse_depth_0 + inverse_depth_x * at_px.x + inverse_depth_y * at_px.y;
  }
  Mask8 are_strips() const { return {object_id >= (kStripKind << kKindShift)}; }

 private:
  // Loads the four members of each face from an offset on.
  template <std::size_t kOffset>
  static void load_four(const ScreenFace* const* face, Float8* members_out) {
    static_assert(offsetof(ScreenFace, object_id) == offsetof(ScreenFace, inverse_depth_x) + 3 * sizeof(float));
    static_assert(offsetof(ScreenFace, plane_distance_m) ==
                  offsetof(ScreenFace, inverse_depth_low) + 3 * sizeof(float));
    transpose_four([face](int lane) { return reinterpret_cast<const char*>(face[lane]) + kOffset; }, members_out);
  }
};

/// The lanes in which a is in front of b at all shared samples; and those that occlude_pair() must decide, because the
/// faces are of one primitive or change places there, or because a solid may stand on a strip.
struct PairOrder {
  unsigned a_first = 0, undecided = 0;
};
inline PairOrder order_pairs(const PairsX8& pairs) {
  const FacesX8 a(pairs.a), b(pairs.b);
  const Vec2x8 at = Vec2x8{load8(pairs.x), load8(pairs.y)} + centroid_of_x8(pairs.shared);
  const Float8 inverse_depth_a = a.inverse_depth(at), inverse_depth_b = b.inverse_depth(at);
  const Mask8 strip_a = a.are_strips(), strip_b = b.are_strips(), lower_id{a.object_id < b.object_id},
              of_one_primitive{a.object_id == b.object_id};

  // samples_in_front()
  const Float8 distance = inverse_depth_a - inverse_depth_b;
  const Float8 lead =
      select(lower_id, distance, -distance) + kEqualDepth * max_no_nan(inverse_depth_a, inverse_depth_b);
  const Mask8 change_places =
      (fabs8(lead) < fabs8(a.inverse_depth_x - b.inverse_depth_x) + fabs8(a.inverse_depth_y - b.inverse_depth_y)) &
      ~strip_a & ~strip_b;

  // is_in_front()
  auto clamped = [](Float8 x, const FacesX8& face) {
    return min_no_nan(max_no_nan(x, face.inverse_depth_low), face.inverse_depth_high);
  };
  const Float8 clamped_a = clamped(inverse_depth_a, a), clamped_b = clamped(inverse_depth_b, b);
  const Float8 nearest = max_no_nan(clamped_a, clamped_b);
  const Float8 above_a = (inverse_depth_a - nearest) * a.plane_distance_m;
  const Float8 above_b = (inverse_depth_b - nearest) * b.plane_distance_m;
  const Mask8 of_one_level = strip_a & strip_b & (fabs8(above_a - above_b) < kSameLevel_m * nearest);
  const Mask8 by_id = of_one_level | (fabs8(clamped_a - clamped_b) < kEqualDepth * nearest);
  const Mask8 a_first = (by_id & lower_id) | (~by_id & (clamped_a > clamped_b));
  const Mask8 is_strip_first = ~(a_first ^ strip_a);
  const Mask8 is_from_below = select(strip_a, a.plane_distance_m, b.plane_distance_m) > 0.0f;
  const Mask8 may_stand = (strip_a ^ strip_b) & (is_strip_first ^ is_from_below);
  return {lanes_of(a_first), lanes_of(of_one_primitive | change_places | may_stand)};
}

}  // namespace pictura
