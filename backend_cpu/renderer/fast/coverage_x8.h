// The rules of common/raster/coverage.h for eight rows or pixels at once: the same bits, in AVX2 where the compiler may
// use it.
#pragma once

#include <bit>

#include "pictura/backend_cpu/renderer/fast/float8.h"
#include "pictura/common/raster/coverage.h"

namespace pictura {

/// row_span() of the rows y to y + 7.
struct alignas(32) RowSpansX8 {
  int32_t begin[kLanes], end[kLanes], full_begin[kLanes], full_end[kLanes];
};

#if defined(__AVX2__)

inline __m256 saturate_x8(__m256 x) {
  return _mm256_min_ps(_mm256_max_ps(x, _mm256_setzero_ps()), _mm256_set1_ps(1.0f));
}

inline RowSpansX8 row_spans_x8(const PolygonEdge* edges, int count, const PixelBox& box, int y) {
  const __m256 one = _mm256_set1_ps(1.0f);
  const __m256 y_px =
      _mm256_cvtepi32_ps(_mm256_add_epi32(_mm256_set1_epi32(y), _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7)));
  const __m256 middle_px = _mm256_add_ps(y_px, _mm256_set1_ps(0.5f));
  const __m256 begin = _mm256_set1_ps(static_cast<float>(box.x_begin)),
               end = _mm256_set1_ps(static_cast<float>(box.x_end));
  __m256 touch_low = begin, touch_high = end, full_low = begin, full_high = end, is_outside = _mm256_setzero_ps();
  for (int i = 0; i < count; ++i) {
    const PolygonEdge& edge = edges[i];
    const float side = side_of(edge);
    const __m256 y0 = _mm256_set1_ps(edge.y0);
    if (side == 0.0f) {
      const __m256 inner_px =
          edge.rows_scale > 0.0f ? _mm256_sub_ps(y_px, y0) : _mm256_sub_ps(y0, _mm256_add_ps(y_px, one));
      is_outside = _mm256_or_ps(is_outside, _mm256_cmp_ps(inner_px, _mm256_set1_ps(-1.0f), _CMP_LE_OQ));
      full_high =
          _mm256_blendv_ps(full_high, _mm256_set1_ps(-1.0f), _mm256_cmp_ps(inner_px, _mm256_setzero_ps(), _CMP_LT_OQ));
      continue;
    }
    const __m256 twice_above_px = _mm256_mul_ps(_mm256_set1_ps(2.0f), _mm256_sub_ps(middle_px, y0));
    const __m256 middle =
        _mm256_add_ps(_mm256_set1_ps(edge.x0), _mm256_mul_ps(twice_above_px, _mm256_set1_ps(edge.half_dx_dy)));
    const __m256 reach = _mm256_set1_ps(fabsf(edge.half_dx_dy));
    const __m256 low = _mm256_sub_ps(middle, reach), high = _mm256_add_ps(middle, reach);
    if (side < 0.0f) {
      touch_low = _mm256_max_ps(touch_low, _mm256_sub_ps(low, one));
      full_low = _mm256_max_ps(full_low, high);
    } else {
      touch_high = _mm256_min_ps(touch_high, high);
      full_high = _mm256_min_ps(full_high, _mm256_sub_ps(low, one));
    }
  }
  const __m256 leeway_px = _mm256_set1_ps(kSpanLeeway_px);
  auto first_at_or_after = [&](__m256 x) {
    return _mm256_cvttps_epi32(_mm256_ceil_ps(_mm256_min_ps(_mm256_max_ps(x, begin), end)));
  };
  auto first_after = [&](__m256 x) {
    const __m256 clamped = _mm256_min_ps(_mm256_max_ps(x, _mm256_sub_ps(begin, one)), _mm256_sub_ps(end, one));
    return _mm256_add_epi32(_mm256_cvttps_epi32(_mm256_floor_ps(clamped)), _mm256_set1_epi32(1));
  };
  const __m256i first = first_at_or_after(_mm256_sub_ps(touch_low, leeway_px));
  const __m256i last = _mm256_max_epi32(first_after(_mm256_add_ps(touch_high, leeway_px)), first);
  const __m256i full_first =
      _mm256_min_epi32(_mm256_max_epi32(first_at_or_after(_mm256_add_ps(full_low, leeway_px)), first), last);
  const __m256i full_last =
      _mm256_min_epi32(_mm256_max_epi32(first_after(_mm256_sub_ps(full_high, leeway_px)), full_first), last);
  RowSpansX8 spans;
  auto store = [&](int32_t* to, __m256i from) {
    _mm256_store_si256(reinterpret_cast<__m256i*>(to), _mm256_andnot_si256(_mm256_castps_si256(is_outside), from));
  };
  store(spans.begin, first);
  store(spans.end, last);
  store(spans.full_begin, full_first);
  store(spans.full_end, full_last);
  return spans;
}

/// Calls visit(lane, coverage) for each of the first num_pixels of eight pixels of which pixel_coverage() is not 0.
template <typename Visit>
inline void coverage_x8(const PolygonEdge* edges, int count, float min_area, const int32_t* x, const int32_t* y,
                        int num_pixels, Visit&& visit) {
  const __m256 x_px = _mm256_cvtepi32_ps(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(x)));
  const __m256 y_px = _mm256_cvtepi32_ps(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(y)));
  const __m256 half = _mm256_set1_ps(0.5f);
  constexpr int kPairs = kLanes / 2;
  // Element i has the columns of pixels i and i + 4.
  __m256i low[kPairs], high[kPairs];
  for (int i = 0; i < kPairs; ++i) {
    low[i] = _mm256_set1_epi16(-kFar_units);
    high[i] = _mm256_set1_epi16(kFar_units);
  }
  __m256 area = _mm256_setzero_ps();
  for (int e = 0; e < count; ++e) {
    const PolygonEdge& edge = edges[e];
    const bool is_below = edge.rows_scale > 0.0f;
    const __m256 x0 = _mm256_set1_ps(edge.x0), y0 = _mm256_set1_ps(edge.y0), dy_dx = _mm256_set1_ps(edge.dy_dx);
    // edge_crossing()
    const __m256 left_crossing = _mm256_sub_ps(_mm256_mul_ps(_mm256_sub_ps(x_px, x0), dy_dx), _mm256_sub_ps(y_px, y0));
    const __m256 right_crossing = _mm256_add_ps(left_crossing, dy_dx);
    const __m256 crossings = _mm256_add_ps(left_crossing, right_crossing);
    // area_of()
    const __m256 from = saturate_x8(_mm256_sub_ps(y0, y_px));
    const __m256 to = saturate_x8(_mm256_sub_ps(_mm256_set1_ps(edge.y1), y_px));
    const __m256 left = _mm256_max_ps(_mm256_min_ps(left_crossing, to), from);
    const __m256 right = _mm256_max_ps(_mm256_min_ps(right_crossing, to), from);
    const __m256 beyond = _mm256_sub_ps(_mm256_add_ps(left, right), crossings);
    const __m256 width = saturate_x8(_mm256_add_ps(_mm256_mul_ps(beyond, _mm256_set1_ps(edge.half_dx_dy)), half));
    const __m256 part = _mm256_add_ps(_mm256_mul_ps(_mm256_sub_ps(right, left), width),
                                      _mm256_sub_ps(edge.dy_dx > 0.0f ? to : from, right));
    area = is_below ? _mm256_add_ps(area, part) : _mm256_sub_ps(area, part);
    // narrow(): an edge bounds the heights on one side.
    const __m256 at = saturate_x8(_mm256_add_ps(_mm256_mul_ps(crossings, _mm256_set1_ps(fabsf(edge.rows_scale))),
                                                _mm256_set1_ps(edge.rows_offset)));
    const __m256i heights = _mm256_castps_si256(_mm256_add_ps(at, _mm256_set1_ps(kToLowestBits)));
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
  _mm256_store_ps(areas, area);
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

inline RowSpansX8 row_spans_x8(const PolygonEdge* edges, int count, const PixelBox& box, int y) {
  RowSpansX8 spans;
  for (int i = 0; i < kLanes; ++i) {
    const RowSpan span = row_span(edges, count, box, y + i);
    spans.begin[i] = span.begin;
    spans.end[i] = span.end;
    spans.full_begin[i] = span.full_begin;
    spans.full_end[i] = span.full_end;
  }
  return spans;
}

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
