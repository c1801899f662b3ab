// Edges of convex polygons on screen, precomputed for coverage. For host and CUDA code.
#pragma once

#include "pictura/common/math.h"
#include "pictura/common/portable/int16x8.h"
#include "pictura/common/portable/intrinsics.h"

namespace pictura {

/// An edge of a polygon on screen. Only the sign of rows_scale depends on the edge's direction. So two faces with a
/// common edge split areas and samples exactly.
struct alignas(16) PolygonEdge {
  float x0 = 0, y0 = 0;  // upper end
  float half_dx_dy = 0;  // 0 for level edges
  // Maps the line to sample heights, with rows_offset and rows_step. Negative if the face is above the edge. row_span()
  // reads no later member.
  float rows_scale = 0;
  float y1 = 0;     // lower end; y0 for level edges
  float dy_dx = 0;  // 0 for level edges
  float rows_offset = 0;
  int32_t rows_step = 0;
};

/// Calls visit(edge) for each edge, and loads the next edge during the visit. Two variables alternate, so that no edge
/// is copied.
template <typename Visit>
PICTURA_HD inline void for_each_edge(const PolygonEdge* edges, int count, Visit&& visit) {
  PolygonEdge even = edges[0], odd;
  PICTURA_NO_UNROLL
  for (int i = 1;; i += 2) {
    if (i < count) odd = edges[i];
    visit(even);
    if (i >= count) return;
    if (i + 1 < count) even = edges[i + 1];
    visit(odd);
    if (i + 1 >= count) return;
  }
}

/// An edge is level, and bounds no area, if its ends differ by less than kLevel_px in y. Differences in x below
/// kUpright_px are increased to it.
constexpr float kLevel_px = 1e-6f, kUpright_px = 1e-6f;
constexpr int kSampleColumns = kInt16x8Size, kSampleRows = 8;
/// Sample tests use 16-bit heights, kRowUnits per row, relative to the pixel's centre. Heights are clamped to
/// +-kLines_rows / 2 in the first column right of the centre. They change by at most kSteepest rows per column, so 16
/// bits do not overflow. Steeper lines get this slope. With its own slope, an upright line would cut off only whole
/// columns of samples, each an eighth of the pixel.
constexpr int kRowUnits = 128;
constexpr float kLines_rows = 256.0f, kSteepest = 9.0f;

PICTURA_HD inline PolygonEdge make_edge(Vec2 from, Vec2 to) {
  const bool downward = from.y < to.y || (from.y == to.y && from.x < to.x);
  const Vec2 upper = downward ? from : to, lower = downward ? to : from;
  const bool is_upright = fabsf(lower.x - upper.x) < kUpright_px, is_level = lower.y - upper.y < kLevel_px;
  const float dx = is_upright ? kUpright_px : lower.x - upper.x, dy = is_level ? 0.0f : lower.y - upper.y;
  const float dx_dy = is_level ? 0.0f : dx * reciprocal_in_range(dy);
  PolygonEdge edge;
  edge.x0 = upper.x;
  edge.y0 = upper.y;
  edge.y1 = is_level ? upper.y : lower.y;
  edge.dy_dx = dy * reciprocal_in_range(dx);
  edge.half_dx_dy = 0.5f * dx_dy;
  // Reduces the slope of steep lines. They still cross the height of the pixel's centre at the same x.
  const float shrink = is_level ? 1.0f : min_of(kSteepest * fabsf(dx_dy), 1.0f);
  const float scale = shrink * (0.5f * kSampleRows / kLines_rows), step_rows = shrink * edge.dy_dx;
  // rows_scale and rows_offset map the sum of the line's heights at both sides of the pixel to one height. The result
  // is the height in the first column right of the centre, as a fraction of kLines_rows. 0.5 is the pixel's centre.
  edge.rows_scale = (dx > 0.0f) == downward ? scale : -scale;
  edge.rows_offset = 0.5f - scale + step_rows * (0.5f / kLines_rows);
  edge.rows_step = static_cast<int32_t>(floorf(step_rows * kRowUnits + 0.5f));
  return edge;
}

/// Positive if the face is left of the edge, negative if right, 0 for level edges.
PICTURA_HD inline float side_of(const PolygonEdge& edge) { return edge.rows_scale * edge.half_dx_dy; }

/// Whether a point is on the line of an edge or on its inner side.
PICTURA_HD inline bool is_inside(const PolygonEdge& edge, Vec2 p) {
  const float below_px = (p.y - edge.y0) - (p.x - edge.x0) * edge.dy_dx;
  return (edge.rows_scale > 0.0f ? below_px : -below_px) >= 0.0f;
}

/// Calls store_edge(i, edge) for each edge of positive length. Returns the number of edges.
template <typename StoreEdge>
PICTURA_HD inline int make_edges(const Vec2* corner, int count, bool is_clockwise, StoreEdge&& store_edge) {
  int edges = 0;
  PICTURA_UNROLL_FOUR
  for (int i = 0; i < count; ++i) {
    const Vec2 from = corner[i], to = corner[i + 1 < count ? i + 1 : 0];
    if (from.x == to.x && from.y == to.y) continue;
    store_edge(edges++, make_edge(is_clockwise ? from : to, is_clockwise ? to : from));
  }
  return edges;
}

}  // namespace pictura
