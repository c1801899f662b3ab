// Coverage of a pixel by a convex polygon: the exact area and a mask of 64 samples. Bitwise equal on host and CUDA
// devices.
#pragma once

#include "pictura/common/portable/int16x8.h"
#include "pictura/common/portable/intrinsics.h"
#include "pictura/common/raster/project.h"

namespace pictura {

PICTURA_HD inline bool covers_point(const PolygonEdge* edges, int count, float x_px, float y_px) {
  PICTURA_NO_UNROLL
  for (int i = 0; i < count; ++i) {
    if (!is_inside(edges[i], {x_px, y_px})) return false;
  }
  return true;
}

/// Mask of samples: 8 columns of 8 rows. Sample (column, row) is bit 8 * column + row. All samples have different
/// heights, because many edges are nearly level.
constexpr uint64_t kAllSamples = ~uint64_t{0};
/// Offset of a column's first sample from the pixel's top, in rows.
PICTURA_HD constexpr float sample_column_offset(int column) {
  // Bit reversal gives neighbouring columns distant offsets.
  const int reversed = ((column & 1) << 2) | (column & 2) | ((column & 4) >> 2);
  return (static_cast<float>(reversed) + 0.5f) / 8.0f;
}

struct PixelCoverage {
  float area = 0;  // in [0, 1]
  uint64_t samples = 0;
  PICTURA_HD bool is_full() const { return area == 1.0f && samples == kAllSamples; }
};

/// Samples of a coverage; all samples for a sliver, which covers an area but no sample.
PICTURA_HD inline uint64_t effective_samples(const PixelCoverage& coverage) {
  return coverage.samples != 0 ? coverage.samples : kAllSamples;
}

/// Tolerance of the area of a fully covered pixel.
constexpr float kFullCoverage = 1e-3f;
/// Makes a coverage from samples and the sum of area_of() over a polygon's edges.
PICTURA_HD inline PixelCoverage rounded_coverage(float area, uint64_t samples) {
  if (samples == kAllSamples && area > 1.0f - kFullCoverage) return {1.0f, kAllSamples};
  return {min_of(area, 1.0f), samples};
}

/// Heights of an edge's line at both sides of a pixel, in pixels from the pixel's top.
struct EdgeCrossing {
  float left = 0, right = 0;
};
/// (left_px, top_px) is the pixel's top left corner relative to the edge's upper end.
PICTURA_HD inline EdgeCrossing edge_crossing(const PolygonEdge& edge, float left_px, float top_px) {
  const float left = left_px * edge.dy_dx - top_px;
  return {left, left + edge.dy_dx};
}

/// For each column, the range of heights (kRowUnits per row) inside all edges so far.
struct SampleRange {
  Int16x8 low, high;
};
constexpr int kFar_units = 64 * kRowUnits;
PICTURA_HD inline SampleRange whole_range() {
  return {make_int16x8([](int) { return -kFar_units; }), make_int16x8([](int) { return kFar_units; })};
}

/// Summand that moves a height to the lowest bits of a float's mantissa. The height is divided by kLines_rows
/// (edges.h).
constexpr float kToLowestBits = 1 << 8;  // the lowest bit is 1 / (kLines_rows * kRowUnits)
/// For each column, an edge's height minus its height in the first column right of the pixel's centre, minus 2^14.
/// narrow() adds the height in that column. The added height is 2^14 for a line at the pixel's centre, so the 2^14
/// cancels and sums are relative to the centre.
PICTURA_HD inline Int16x8 column_heights(const PolygonEdge& edge) {
  return arithmetic_sequence(edge.rows_step, (1 << 16) - (1 << 14));
}

/// Clips each column's range to the inner side of an edge.
PICTURA_HD inline void narrow(const PolygonEdge& edge, const EdgeCrossing& crossing, SampleRange* range_inout) {
  constexpr uint32_t kLowest = 0, kHighest = 0x80008000u;
  const float at = saturate((crossing.left + crossing.right) * fabsf(edge.rows_scale) + edge.rows_offset);
  const uint32_t height = broadcast_low16(bits_from_float(at + kToLowestBits));
  const Int16x8 columns = column_heights(edge);
  const bool is_below = edge.rows_scale > 0.0f;
  range_inout->low = add_max(columns, is_below ? height : kLowest, range_inout->low);
  range_inout->high = add_min(columns, is_below ? kHighest : height, range_inout->high);
}

/// Offset of each column. A height plus the offset, rounded down to whole rows, is the number of samples above the
/// height.
PICTURA_HD inline Int16x8 offsets_from_top() {
  return make_int16x8([](int column) {
    return kSampleRows / 2 * kRowUnits + kRowUnits - 1 -
           static_cast<int>(sample_column_offset(column) * static_cast<float>(kRowUnits));
  });
}

PICTURA_HD inline uint64_t samples_within(const SampleRange& range) {
  const Int16x8 from_top = offsets_from_top();
  const Int16x8 to = add_clamp(range.high, from_top, make_int16x8([](int) { return kSampleRows * kRowUnits; }));
  return bits_between(add_clamp(range.low, from_top, to), to);
}

/// Samples on the inner side of an edge. See edge_crossing() for (left_px, top_px).
PICTURA_HD inline uint64_t samples_inside(const PolygonEdge& edge, float left_px, float top_px) {
  SampleRange range = whole_range();
  narrow(edge, edge_crossing(edge, left_px, top_px), &range);
  return samples_within(range);
}

/// An edge's contribution to a polygon's area in a pixel. An edge on the polygon's right adds the area left of the
/// edge, and an edge on the left subtracts it. A term that cancels over a closed polygon is omitted.
PICTURA_HD inline float area_of(const PolygonEdge& edge, const EdgeCrossing& crossing, float y_px) {
  const float from = saturate(edge.y0 - y_px), to = saturate(edge.y1 - y_px);
  // Between these heights, the edge is within the pixel's width. At heights beyond `right`, the pixel's whole width is
  // left of the edge.
  const float left = max_no_nan(min_no_nan(crossing.left, to), from);
  const float right = max_no_nan(min_no_nan(crossing.right, to), from);
  // Mean width of the area left of the edge.
  const float width = saturate(((left + right) - (crossing.left + crossing.right)) * edge.half_dx_dy + 0.5f);
  const float area = (right - left) * width + ((edge.dy_dx > 0.0f ? to : from) - right);
  return edge.rows_scale > 0.0f ? area : -area;
}

/// Coverage of pixel (x, y) by a convex polygon; empty if the area is below min_area.
PICTURA_HD inline PixelCoverage pixel_coverage(const PolygonEdge* edges, int count, float min_area, int x, int y) {
  const float x_px = no_rematerialize(static_cast<float>(x)), y_px = no_rematerialize(static_cast<float>(y));
  float area = 0.0f;
  SampleRange range = whole_range();
  for_each_edge(edges, count, [&](const PolygonEdge& edge) {
    const EdgeCrossing crossing = edge_crossing(edge, x_px - edge.x0, y_px - edge.y0);
    area += area_of(edge, crossing, y_px);
    narrow(edge, crossing, &range);
  });
  if (area < min_area) return {0.0f, 0};
  return rounded_coverage(area, samples_within(range));
}

/// Pixels of a row that a polygon may touch, and pixels that it covers fully.
struct RowSpan {
  int32_t begin = 0, end = 0, full_begin = 0, full_end = 0;
  PICTURA_HD bool is_full(int32_t column) const { return column >= full_begin && column < full_end; }
};

/// Margin at the ends of spans, within which pixel_coverage() decides.
constexpr float kSpanLeeway_px = 1e-3f;

PICTURA_HD inline RowSpan row_span(const PolygonEdge* edges, int count, const PixelBox& box, int y) {
  const float y_px = static_cast<float>(y), middle_px = y_px + 0.5f;
  float touch_low = static_cast<float>(box.x_begin), touch_high = static_cast<float>(box.x_end);
  float full_low = touch_low, full_high = touch_high;
  bool is_outside = false;
  for_each_edge(edges, count, [&](const PolygonEdge& edge) {
    const float side = side_of(edge);
    if (side == 0.0f) {
      // Level edge.
      const float inner_px = edge.rows_scale > 0.0f ? y_px - edge.y0 : edge.y0 - (y_px + 1.0f);
      if (inner_px <= -1.0f) is_outside = true;
      if (inner_px < 0.0f) full_high = -1.0f;
      return;
    }
    // `middle` is the line's x at the row's centre. `reach` is half of the line's range of x within the row.
    const float twice_above_px = 2.0f * (middle_px - edge.y0), middle = edge.x0 + twice_above_px * edge.half_dx_dy;
    const float reach = fabsf(edge.half_dx_dy), low = middle - reach, high = middle + reach;
    if (side < 0.0f) {
      touch_low = max_no_nan(touch_low, low - 1.0f);
      full_low = max_no_nan(full_low, high);
    } else {
      touch_high = min_no_nan(touch_high, high);
      full_high = min_no_nan(full_high, low - 1.0f);
    }
  });
  if (is_outside) return {};
  const float begin = static_cast<float>(box.x_begin), end = static_cast<float>(box.x_end);
  auto first_at_or_after = [&](float x) { return static_cast<int>(ceilf(clamp(x, begin, end))); };
  auto first_after = [&](float x) { return static_cast<int>(floorf(clamp(x, begin - 1.0f, end - 1.0f))) + 1; };
  RowSpan span;
  span.begin = first_at_or_after(touch_low - kSpanLeeway_px);
  span.end = max_of(first_after(touch_high + kSpanLeeway_px), span.begin);
  span.full_begin = min_of(max_of(first_at_or_after(full_low + kSpanLeeway_px), span.begin), span.end);
  span.full_end = min_of(max_of(first_after(full_high - kSpanLeeway_px), span.full_begin), span.end);
  return span;
}

/// Whether a polygon covers the centre of a pixel. span: row_span() of the pixel's row, and the pixel's column relative
/// to the same column as the span's.
PICTURA_HD inline bool covers_center(const PolygonEdge* edges, int count, const RowSpan& span, int column,
                                     Vec2 center_px) {
  if (column < span.begin || column >= span.end) return false;
  return span.is_full(column) || covers_point(edges, count, center_px.x, center_px.y);
}

}  // namespace pictura
