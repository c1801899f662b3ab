// Functions of common/raster/coverage.h for eight rows or pixels in parallel (SIMD).
#pragma once

#include <bit>

#include "pictura/backend_cpu/renderer/fast/vectors_x8.h"
#include "pictura/common/raster/coverage.h"

namespace pictura {

/// Results of row_span() for the rows y to y + 7.
struct alignas(32) RowSpansX8 {
  int32_t begin[kLanes], end[kLanes], full_begin[kLanes], full_end[kLanes];
};

inline RowSpansX8 row_spans_x8(const PolygonEdge* edges, int count, const PixelBox& box, int y) {
  const Float8 y_px = lane_numbers() + static_cast<float>(y), middle_px = y_px + 0.5f;
  const Float8 begin = static_cast<float>(box.x_begin), end = static_cast<float>(box.x_end);
  Float8 touch_low = begin, touch_high = end, full_low = begin, full_high = end;
  Mask8 is_outside = y_px < y_px;
  for (int i = 0; i < count; ++i) {
    const PolygonEdge& edge = edges[i];
    const float side = side_of(edge);
    if (side == 0.0f) {
      const Float8 inner_px = edge.rows_scale > 0.0f ? y_px - edge.y0 : edge.y0 - (y_px + 1.0f);
      is_outside = is_outside | (inner_px <= -1.0f);
      full_high = select(inner_px < 0.0f, -1.0f, full_high);
      continue;
    }
    const Float8 twice_above_px = 2.0f * (middle_px - edge.y0), middle = edge.x0 + twice_above_px * edge.half_dx_dy;
    const float reach = fabsf(edge.half_dx_dy);
    const Float8 low = middle - reach, high = middle + reach;
    if (side < 0.0f) {
      touch_low = max_no_nan(touch_low, low - 1.0f);
      full_low = max_no_nan(full_low, high);
    } else {
      touch_high = min_no_nan(touch_high, high);
      full_high = min_no_nan(full_high, low - 1.0f);
    }
  }
  auto clamped = [](const Float8& x, const Float8& low, const Float8& high) {
    return min_no_nan(max_no_nan(x, low), high);
  };
  auto first_at_or_after = [&](const Float8& x) { return round_up(clamped(x, begin, end)); };
  auto first_after = [&](const Float8& x) { return round_down(clamped(x, begin - 1.0f, end - 1.0f)) + 1.0f; };
  const Float8 first = first_at_or_after(touch_low - kSpanLeeway_px);
  const Float8 last = max_no_nan(first_after(touch_high + kSpanLeeway_px), first);
  const Float8 full_first = clamped(first_at_or_after(full_low + kSpanLeeway_px), first, last);
  const Float8 full_last = clamped(first_after(full_high - kSpanLeeway_px), full_first, last);
  RowSpansX8 spans;
  auto store = [&](int32_t* to, const Float8& x) { store8_integers(select(is_outside, 0.0f, x), to); };
  store(spans.begin, first);
  store(spans.end, last);
  store(spans.full_begin, full_first);
  store(spans.full_end, full_last);
  return spans;
}

/// Calls visit(lane, coverage) for each of the first num_pixels pixels whose pixel_coverage() is not empty.
#if defined(__AVX2__)
template <typename Visit>
inline void coverage_x8(const PolygonEdge* edges, int count, float min_area, const int32_t* x, const int32_t* y,
                        int num_pixels, Visit&& visit) {
  const Float8 x_px = load8_integers(x), y_px = load8_integers(y);
  constexpr int kPairs = kLanes / 2;
  // Element i holds the sample columns of pixels i and i + 4.
  __m256i low[kPairs], high[kPairs];
  for (int i = 0; i < kPairs; ++i) {
    low[i] = _mm256_set1_epi16(-kFar_units);
    high[i] = _mm256_set1_epi16(kFar_units);
  }
  Float8 area = 0.0f;
  for (int e = 0; e < count; ++e) {
    const PolygonEdge& edge = edges[e];
    const bool is_below = edge.rows_scale > 0.0f;
    // edge_crossing()
    const Float8 left_crossing = (x_px - edge.x0) * edge.dy_dx - (y_px - edge.y0);
    const Float8 right_crossing = left_crossing + edge.dy_dx, crossings = left_crossing + right_crossing;
    // area_of()
    const Float8 from = saturate(edge.y0 - y_px), to = saturate(edge.y1 - y_px);
    const Float8 left = max_no_nan(min_no_nan(left_crossing, to), from);
    const Float8 right = max_no_nan(min_no_nan(right_crossing, to), from);
    const Float8 width = saturate(((left + right) - crossings) * edge.half_dx_dy + 0.5f);
    const Float8 part = (right - left) * width + ((edge.dy_dx > 0.0f ? to : from) - right);
    area = is_below ? area + part : area - part;
    // narrow(): each edge is a lower or an upper bound of the heights.
    const Float8 at = saturate(crossings * fabsf(edge.rows_scale) + edge.rows_offset);
    const __m256i heights = _mm256_castps_si256((at + kToLowestBits).value);
    const __m256i columns = _mm256_broadcastsi128_si256(std::bit_cast<__m128i>(column_heights(edge).value));
    __m256i broadcast_low16 = _mm256_set1_epi16(0x0100);
    for (int i = 0; i < kPairs; ++i) {
      const __m256i height = _mm256_add_epi16(columns, _mm256_shuffle_epi8(heights, broadcast_low16));
      if (is_below) {
        low[i] = _mm256_max_epi16(height, low[i]);
      } else {
        high[i] = _mm256_min_epi16(height, high[i]);
      }
      broadcast_low16 = _mm256_add_epi16(broadcast_low16, _mm256_set1_epi16(0x0404));
    }
  }
  // samples_within()
  const __m256i from_top = _mm256_broadcastsi128_si256(std::bit_cast<__m128i>(offsets_from_top().value));
  const __m256i rows = _mm256_set1_epi16(kSampleRows * kRowUnits), zero = _mm256_setzero_si256();
  // Byte i is the mask of the first i samples.
  const __m256i first_samples = _mm256_broadcastsi128_si256(
      _mm_setr_epi8(0x00, 0x01, 0x03, 0x07, 0x0F, 0x1F, 0x3F, 0x7F, -1, 0, 0, 0, 0, 0, 0, 0));
  __m256i samples[kPairs];
  for (int i = 0; i < kPairs; ++i) {
    const __m256i to = _mm256_max_epi16(_mm256_min_epi16(_mm256_add_epi16(high[i], from_top), rows), zero);
    const __m256i from = _mm256_max_epi16(_mm256_min_epi16(_mm256_add_epi16(low[i], from_top), to), zero);
    const __m256i ends = _mm256_packus_epi16(_mm256_srli_epi16(from, 7), _mm256_srli_epi16(to, 7));
    const __m256i above = _mm256_shuffle_epi8(first_samples, ends);
    samples[i] = _mm256_xor_si256(above, _mm256_srli_si256(above, 8));
  }
  alignas(32) float areas[kLanes];
  alignas(32) uint64_t masks[kLanes];
  store8(area, areas);
  const __m256i pixels_01_45 = _mm256_unpacklo_epi64(samples[0], samples[1]);
  const __m256i pixels_23_67 = _mm256_unpacklo_epi64(samples[2], samples[3]);
  _mm256_store_si256(reinterpret_cast<__m256i*>(masks), _mm256_permute2x128_si256(pixels_01_45, pixels_23_67, 0x20));
  _mm256_store_si256(reinterpret_cast<__m256i*>(masks + kPairs),
                     _mm256_permute2x128_si256(pixels_01_45, pixels_23_67, 0x31));
  for (int i = 0; i < num_pixels; ++i) {
    if (!(areas[i] < min_area)) visit(i, rounded_coverage(areas[i], masks[i]));
  }
}

#else

template <typename Visit>
inline void coverage_x8(const PolygonEdge* edges, int count, float min_area, const int32_t* x, const int32_t* y,
                        int num_pixels, Visit&& visit) {
  for (int i = 0; i < num_pixels; ++i) {
    const PixelCoverage coverage = pixel_coverage(edges, count, min_area, x[i], y[i]);
    if (coverage.area > 0.0f) visit(i, coverage);
  }
}

#endif

}  // namespace pictura
