// Edges of convex polygons on screen, in the form in which pixels read them. Shared by both devices.
#pragma once

#include "pictura/common/math.h"
#include "pictura/common/portable/int16x8.h"
#include "pictura/common/portable/intrinsics.h"

namespace pictura {

/// An edge of a polygon on screen. Its numbers do not depend on the direction in which a face walks it, but for the
/// signs of two: faces that share an edge split areas and samples between them exactly.
struct alignas(16) PolygonEdge {
  float x0 = 0, y0 = 0;  // the upper end
  float half_dx_dy = 0;  // of its line; 0 for level edges
  // Where its line passes the samples, with rows_offset and rows_step, see make_edge; negative where the face is above.
  // What row_span asks for ends here.
  float rows_scale = 0;
  float y1 = 0;     // the lower end's y; y0 for level edges, which bound no area
  float dy_dx = 0;  // of its line; 0 for level edges
  float rows_offset = 0;
  int32_t rows_step = 0;
};

/// Visits the edges of a polygon; each is asked for while the one before it is visited. By turns they stand in two
/// places, so that none is moved.
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

/// Edges whose ends are closer in y than this are level, and bound no area. Those whose ends are closer in x lean by as
/// much to the right.
constexpr float kLevel_px = 1e-6f, kUpright_px = 1e-6f;
/// Columns and rows of a pixel's samples.
constexpr int kSampleColumns = kInt16x8Size, kSampleRows = 8;
/// To samples, heights are whole numbers of 16 bits, so many of them a row, from the pixel's middle. There a line is
/// cut off at half of kLines_rows from it in the first column right of the middle, and goes down by at most kSteepest
/// rows from one column to the next: so it leaves the pixel before it is cut off, and nothing leaves the 16 bits.
constexpr int kRowUnits = 128;
constexpr float kLines_rows = 256.0f, kSteepest = 30.0f;

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
  // Of what is steeper, all heights from the pixel's middle are lessened alike: it crosses that at the same place.
  const float shrink = is_level ? 1.0f : min_of(kSteepest * fabsf(dx_dy), 1.0f);
  const float scale = shrink * (0.5f * kSampleRows / kLines_rows), step_rows = shrink * edge.dy_dx;
  // The sum of the heights at which the line passes the pixel's left and right side, in pixels from its top, to that at
  // which it passes the first column right of the middle, in parts of kLines_rows, of which a half is the middle.
  edge.rows_scale = (dx > 0.0f) == downward ? scale : -scale;
  edge.rows_offset = 0.5f - scale + step_rows * (0.5f / kLines_rows);
  edge.rows_step = static_cast<int32_t>(floorf(step_rows * kRowUnits + 0.5f));
  return edge;
}

/// Positive where the face is to the left of an edge, negative where it is to the right of it, 0 for level edges.
PICTURA_HD inline float side_of(const PolygonEdge& edge) { return edge.rows_scale * edge.half_dx_dy; }

/// Whether a point is on the inner side of an edge's line, or on the line.
PICTURA_HD inline bool is_inside(const PolygonEdge& edge, Vec2 p) {
  const float below_px = (p.y - edge.y0) - (p.x - edge.x0) * edge.dy_dx;
  return (edge.rows_scale > 0.0f ? below_px : -below_px) >= 0.0f;
}

/// Calls keep_edge(0, edge), keep_edge(1, edge), ... for the edges of a polygon on screen, at most `count`, and returns
/// how many there are.
template <typename KeepEdge>
PICTURA_HD inline int make_edges(const Vec2* corner, int count, bool is_clockwise, KeepEdge&& keep_edge) {
  int edges = 0;
  PICTURA_UNROLL_FOUR
  for (int i = 0; i < count; ++i) {
    const Vec2 from = corner[i], to = corner[i + 1 < count ? i + 1 : 0];
    if (from.x == to.x && from.y == to.y) continue;
    keep_edge(edges++, make_edge(is_clockwise ? from : to, is_clockwise ? to : from));
  }
  return edges;
}

}  // namespace pictura
