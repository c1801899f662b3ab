// From a face in camera coordinates to pixels: clipping, projection, and for each pixel the exact area that a convex
// polygon covers and which of 64 samples it covers. Shared by both devices, which therefore agree bit for bit.
#pragma once

#include "pictura/common/raster_camera.h"
#include "pictura/common/raster_shapes.h"

namespace pictura {

/// Clipping by five planes adds at most one corner each; one more is room for a cut while it is made.
constexpr int kMaxPolygonCorners = kMaxFaceCorners + 6;

/// One of the five planes of the drawn volume: how far a point is inside, by a measure of each plane's own; negative
/// outside. By weights, so that lanes of a warp may ask for different planes: what is added for one is 0.
constexpr int kClipPlanes = 5;
class ClipPlane {
 public:
  PICTURA_HD ClipPlane(const Frustum& f, int plane)
      : x_(plane == 1 ? 1.0f : (plane == 2 ? -1.0f : 0.0f)),
        y_(plane == 3 ? 1.0f : (plane == 4 ? -1.0f : 0.0f)),
        z_(plane == 0   ? 1.0f
           : plane == 1 ? -f.x_low
           : plane == 2 ? f.x_high
           : plane == 3 ? -f.y_low
                        : f.y_high),
        offset_(plane == 0 ? kNear_m : 0.0f) {}
  PICTURA_HD float inside(Vec3 p) const { return x_ * p.x + y_ * p.y + z_ * p.z - offset_; }

 private:
  float x_, y_, z_, offset_;
};

/// The planes that a point is outside of, a bit for each.
PICTURA_HD inline unsigned planes_outside(const Frustum& f, Vec3 p) {
  unsigned outside = 0;
  for (int plane = 0; plane < kClipPlanes; ++plane) {
    if (ClipPlane(f, plane).inside(p) < 0.0f) outside |= 1u << plane;
  }
  return outside;
}

/// The planes of the drawn volume that a face (camera coordinates) crosses, a bit for each; kOutside where all of it is
/// outside of one.
constexpr unsigned kOutside = ~0u;
PICTURA_HD inline unsigned planes_crossed(const Frustum& f, const Vec3* corners, int count) {
  unsigned outside_of_any = 0, outside_of_all = ~0u;
  PICTURA_UNROLL_FOUR
  for (int i = 0; i < count; ++i) {
    const unsigned outside = planes_outside(f, corners[i]);
    outside_of_any |= outside;
    outside_of_all &= outside;
  }
  return outside_of_all != 0 ? kOutside : outside_of_any;
}

/// Where the side from one corner to the next crosses a plane, of which they are that far inside. Computed from the
/// inner corner, whichever way round: faces that share an edge get the same point.
PICTURA_HD inline Vec3 cut_between(Vec3 a, float a_inside, Vec3 b, float b_inside) {
  const bool a_is_inner = a_inside >= 0.0f;
  const Vec3 inner = a_is_inner ? a : b, outer = a_is_inner ? b : a;
  const float inside = a_is_inner ? a_inside : b_inside, outside = a_is_inner ? b_inside : a_inside;
  return inner + (outer - inner) * (inside * reciprocal_in_range(inside - outside));
}

/// Clips a convex face to the near plane and the guard band. Writes to polygon_out (camera coordinates, room for
/// kMaxPolygonCorners) and returns the number of corners; below 3 nothing is left.
PICTURA_HD inline int clip_face(const Frustum& f, const Vec3* corners, int count, Vec3* polygon_out) {
  const unsigned crossed = planes_crossed(f, corners, count);
  if (crossed == kOutside) return 0;
  Vec3 buffer[kMaxPolygonCorners];
  const Vec3* from = corners;
  int remaining_planes = 0;
  for (int plane = 0; plane < kClipPlanes; ++plane) remaining_planes += (crossed >> plane) & 1u;
  if (remaining_planes == 0) {
    PICTURA_NO_UNROLL
    for (int i = 0; i < count; ++i) polygon_out[i] = corners[i];
    return count;
  }
  // The buffers alternate so that the last plane writes to polygon_out.
  PICTURA_NO_UNROLL
  for (int number = 0; number < kClipPlanes; ++number) {
    if (!((crossed >> number) & 1u)) continue;
    const ClipPlane plane(f, number);
    Vec3* to = (remaining_planes & 1) ? polygon_out : buffer;
    int kept = 0;
    Vec3 previous = from[count - 1];
    float previous_inside = plane.inside(previous);
    // Only a face that is not quite convex could outgrow the room; it loses corners then.
    PICTURA_NO_UNROLL
    for (int i = 0; i < count && kept + 2 <= kMaxPolygonCorners; ++i) {
      const Vec3 current = from[i];
      const float current_inside = plane.inside(current);
      if ((previous_inside >= 0.0f) != (current_inside >= 0.0f)) {
        to[kept++] = cut_between(previous, previous_inside, current, current_inside);
      }
      if (current_inside >= 0.0f) to[kept++] = current;
      previous = current;
      previous_inside = current_inside;
    }
    if (kept < 3) return 0;
    count = kept;
    from = to;
    --remaining_planes;
  }
  return count;
}

/// Where a point in front of the near plane is on screen.
PICTURA_HD inline Vec2 project(const PinholeCamera& camera, Vec3 p, float inverse_depth) {
  return {camera.center_x_px + camera.focal_x_px * (p.x * inverse_depth),
          camera.center_y_px + camera.focal_y_px * (p.y * inverse_depth)};
}

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
PICTURA_HD inline void each_edge(const PolygonEdge* edges, int count, Visit&& visit) {
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
  const float lessened = is_level ? 1.0f : min_of(kSteepest * fabsf(dx_dy), 1.0f);
  const float scale = lessened * (0.5f * kSampleRows / kLines_rows), step_rows = lessened * edge.dy_dx;
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

/// Pixels that a polygon may touch: half-open ranges within the image.
struct PixelBox {
  int16_t x_begin = 0, x_end = 0, y_begin = 0, y_end = 0;
};

/// A convex polygon on screen, without its edges, which stand in a pool. In the order in which it is asked for.
struct alignas(16) ScreenFace {
  PixelBox box;
  int32_t edge_begin = 0;
  uint8_t edge_count = 0;
  uint8_t class_id = 0;         // of the class plane
  uint16_t min_area_units = 0;  // see min_area()
  // Inverse depth at a point of the screen.
  float inverse_depth_x = 0, inverse_depth_y = 0, inverse_depth_0 = 0;
  uint32_t object_id = 0;  // of the thing that it belongs to, see raster_order.h
  // Range of the inverse depth over the face's corners.
  float inverse_depth_low = 0, inverse_depth_high = 0;
  float plane_distance_m = 0;  // from the camera to the face's plane
  uint32_t color_bytes = 0;    // to_bytes(color), for devices
  Rgb color;

  /// What it covers less of a pixel than this is nothing, see min_area_of.
  PICTURA_HD float min_area() const { return static_cast<float>(min_area_units) * (1.0f / kAreaUnits); }
  PICTURA_HD void set_min_area(float area) { min_area_units = static_cast<uint16_t>(area * kAreaUnits + 0.5f); }

 private:
  static constexpr float kAreaUnits = 1 << 16;
};
static_assert(sizeof(ScreenFace) == 4 * 16);

/// What bounds the corners of a polygon on screen.
struct ScreenBounds {
  Vec2 low{1e30f, 1e30f}, high{-1e30f, -1e30f};
  float inverse_depth_low = 1e30f, inverse_depth_high = 0.0f;
  PICTURA_HD void add(Vec2 corner, float inverse_depth) {
    low = {min_no_nan(low.x, corner.x), min_no_nan(low.y, corner.y)};
    high = {max_no_nan(high.x, corner.x), max_no_nan(high.y, corner.y)};
    inverse_depth_low = min_no_nan(inverse_depth_low, inverse_depth);
    inverse_depth_high = max_no_nan(inverse_depth_high, inverse_depth);
  }
  /// Whether they are within an image and so much around it.
  PICTURA_HD bool are_within(const PinholeCamera& camera, float margin_px) const {
    return low.x >= -margin_px && low.y >= -margin_px && high.x <= static_cast<float>(camera.width_px) + margin_px &&
           high.y <= static_cast<float>(camera.height_px) + margin_px;
  }
  /// What of them is in the image.
  PICTURA_HD Aabb2 in_image(const PinholeCamera& camera) const {
    return {{max_no_nan(low.x, 0.0f), max_no_nan(low.y, 0.0f)},
            {min_no_nan(high.x, static_cast<float>(camera.width_px)),
             min_no_nan(high.y, static_cast<float>(camera.height_px))}};
  }
  /// Whether the polygon may touch pixels of an image.
  PICTURA_HD bool meet_image(const PinholeCamera& camera) const {
    return high.x >= 0.0f && high.y >= 0.0f && low.x < static_cast<float>(camera.width_px) &&
           low.y < static_cast<float>(camera.height_px);
  }
};

/// The pixels of an image that a polygon may touch whose bounds meet the image and are within the guard band.
PICTURA_HD inline PixelBox pixel_box(const PinholeCamera& camera, const ScreenBounds& bounds) {
  auto pixel_of = [](float at) { return static_cast<int>(floorf(at)); };
  return {static_cast<int16_t>(max_of(pixel_of(bounds.low.x), 0)),
          static_cast<int16_t>(min_of(pixel_of(bounds.high.x) + 1, camera.width_px)),
          static_cast<int16_t>(max_of(pixel_of(bounds.low.y), 0)),
          static_cast<int16_t>(min_of(pixel_of(bounds.high.y) + 1, camera.height_px))};
}

/// Polygons of less than half of this are nothing.
constexpr float kMinTwiceArea_px2 = 1e-6f;

/// Whether a plane has an inverse depth: faces without an area and planes through the camera have none.
PICTURA_HD inline bool has_inverse_depth(const FacePlane& plane) {
  constexpr float kMinMagnitude = 1e-30f;
  return dot(plane.normal, plane.normal) > kMinMagnitude && fabsf(plane.offset) > kMinMagnitude;
}
/// Inverse depth of a plane as a linear function of the screen: of x, of y, and at (0, 0). normal . p = offset on the
/// plane, and p = depth * ray: inverse depth is linear in the ray.
PICTURA_HD inline Vec3 inverse_depth_plane(const PinholeCamera& camera, const Frustum& f, const FacePlane& plane) {
  const Vec3 inverse = plane.normal * (has_inverse_depth(plane) ? reciprocal_in_range(plane.offset) : 0.0f);
  const float x = inverse.x * f.x_per_px, y = inverse.y * f.y_per_px;
  return {x, y, inverse.z - x * camera.center_x_px - y * camera.center_y_px};
}

/// Sets what the bounds of a face, which meet the image, and its plane say of it.
PICTURA_HD inline void set_bounds(const PinholeCamera& camera, const Frustum& f, const ScreenBounds& bounds,
                                  const FacePlane& plane, ScreenFace* face_out) {
  face_out->box = pixel_box(camera, bounds);
  face_out->inverse_depth_low = bounds.inverse_depth_low;
  face_out->inverse_depth_high = bounds.inverse_depth_high;
  const Vec3 inverse_depth = inverse_depth_plane(camera, f, plane);
  face_out->inverse_depth_x = inverse_depth.x;
  face_out->inverse_depth_y = inverse_depth.y;
  face_out->inverse_depth_0 = inverse_depth.z;
  face_out->plane_distance_m =
      has_inverse_depth(plane)
          ? fabsf(plane.offset) * reciprocal_in_range(sqrt_in_range(dot(plane.normal, plane.normal)))
          : 0.0f;
}

/// Calls keep_edge(0, edge), keep_edge(1, edge), ... for the edges of a polygon on screen, at most `count`, and returns
/// how many there are.
template <typename KeepEdge>
PICTURA_HD inline int make_edges(const Vec2* corner, int count, bool turns_right, KeepEdge&& keep_edge) {
  int edges = 0;
  PICTURA_UNROLL_FOUR
  for (int i = 0; i < count; ++i) {
    const Vec2 from = corner[i], to = corner[i + 1 < count ? i + 1 : 0];
    if (from.x == to.x && from.y == to.y) continue;
    keep_edge(edges++, make_edge(turns_right ? from : to, turns_right ? to : from));
  }
  return edges;
}

/// Projects a clipped face (camera coordinates) of at most kMaxCorners corners, which lies in `plane`. Calls keep_edge
/// as make_edges does, and sets all of face_out but edge_begin and what it belongs to. False where it covers nothing.
template <int kMaxCorners, typename Corners, typename KeepEdge>
PICTURA_HD inline bool make_screen_face(const PinholeCamera& camera, const Frustum& f, const Corners& polygon,
                                        int count, const FacePlane& plane, Rgb color, KeepEdge&& keep_edge,
                                        ScreenFace* face_out) {
  Vec2 corner[kMaxCorners];
  ScreenBounds bounds;
  PICTURA_UNROLL_FOUR
  for (int i = 0; i < count; ++i) {
    const Vec3 p = polygon[i];
    const float inverse_depth = reciprocal_in_range(p.z);
    corner[i] = project(camera, p, inverse_depth);
    bounds.add(corner[i], inverse_depth);
  }
  if (!bounds.meet_image(camera)) return false;
  float twice_area = 0.0f;
  PICTURA_UNROLL_FOUR
  for (int i = 1; i + 1 < count; ++i) twice_area += cross(corner[i] - corner[0], corner[i + 1] - corner[0]);
  if (fabsf(twice_area) < kMinTwiceArea_px2) return false;
  face_out->edge_count = static_cast<uint8_t>(make_edges(corner, count, twice_area > 0.0f, keep_edge));
  face_out->color = color;
  set_bounds(camera, f, bounds, plane, face_out);
  return true;
}

/// A face of four corners on screen.
struct ScreenQuad {
  Vec2 corner[4];
  ScreenBounds bounds;
};

/// What is to be done with a face of four corners: nothing, where it is out of the image; draw it; or clip it first.
enum class QuadSight : uint8_t { none, whole, cut };

/// Projects a face of four corners, a strip with its corners pushed apart where it is less than floor_px wide. What
/// needs no clipping, nearly all, is thus never widened in camera coordinates.
PICTURA_HD inline QuadSight project_quad(const PinholeCamera& camera, const Vec3* corners, float floor_px,
                                         ScreenQuad* quad_out) {
  const float nearest_m = min_no_nan(min_no_nan(corners[0].z, corners[1].z), min_no_nan(corners[2].z, corners[3].z));
  Vec2* const corner = quad_out->corner;
  float inverse_depth[4];
  for (int i = 0; i < 4; ++i) {
    inverse_depth[i] = reciprocal_in_range(corners[i].z);
    corner[i] = project(camera, corners[i], inverse_depth[i]);
  }
  if (floor_px > 0.0f) {
    const Widening widening = widening_of(camera, floor_px, corners[0] + corners[1], corners[3] + corners[2]);
    const Vec2 at_a = widening.push_px(corner[0] - corner[1]), at_b = widening.push_px(corner[3] - corner[2]);
    corner[0] = corner[0] + at_a;
    corner[1] = corner[1] - at_a;
    corner[2] = corner[2] - at_b;
    corner[3] = corner[3] + at_b;
  }
  ScreenBounds* const bounds = &quad_out->bounds;
  *bounds = {};
  for (int i = 0; i < 4; ++i) bounds->add(corner[i], inverse_depth[i]);
  const bool is_whole = bounds->are_within(camera, kGuardBand_px);
  // Of what reaches behind the near plane all that was computed means nothing.
  if (nearest_m < kNear_m) return QuadSight::cut;
  return !bounds->meet_image(camera) ? QuadSight::none : (is_whole ? QuadSight::whole : QuadSight::cut);
}

/// Sets whether a face turns right on screen; false where it covers less than that.
PICTURA_HD inline bool find_turn(const ScreenQuad& quad, float min_twice_area_px2, bool* turns_right_out) {
  const float twice_area = cross(quad.corner[2] - quad.corner[0], quad.corner[3] - quad.corner[1]);
  *turns_right_out = twice_area > 0.0f;
  return fabsf(twice_area) >= min_twice_area_px2;
}

/// make_screen_face of what project_quad found to be whole and find_turn to cover something.
template <typename KeepEdge>
PICTURA_HD inline void make_quad_face(const PinholeCamera& camera, const Frustum& f, const ScreenQuad& quad,
                                      bool turns_right, const FacePlane& plane, Rgb color, KeepEdge&& keep_edge,
                                      ScreenFace* face_out) {
  face_out->edge_count = static_cast<uint8_t>(make_edges(quad.corner, 4, turns_right, keep_edge));
  face_out->color = color;
  set_bounds(camera, f, quad.bounds, plane, face_out);
}

/// 1 / depth of a face's plane at a point of the screen; negative where the plane is behind the camera.
PICTURA_HD inline float inverse_depth(const ScreenFace& face, Vec2 at_px) {
  return face.inverse_depth_0 + face.inverse_depth_x * at_px.x + face.inverse_depth_y * at_px.y;
}

/// Depth (camera z) of a face at a point of the screen, within the depths of its corners.
PICTURA_HD inline float face_depth_m(const ScreenFace& face, Vec2 at_px) {
  return 1.0f / clamp(inverse_depth(face, at_px), face.inverse_depth_low, face.inverse_depth_high);
}

PICTURA_HD inline bool covers_point(const PolygonEdge* edges, int count, float x_px, float y_px) {
  PICTURA_NO_UNROLL
  for (int i = 0; i < count; ++i) {
    if (!is_inside(edges[i], {x_px, y_px})) return false;
  }
  return true;
}

/// The samples of a pixel: 8 columns of 8 rows, each column shifted down by its own part of a row, so that 64 different
/// heights occur: road scenes are full of nearly level edges. Sample (column, row) is bit 8 * column + row.
constexpr uint64_t kAllSamples = ~uint64_t{0};
/// Offset of a column's first sample from the pixel's top, in rows.
PICTURA_HD constexpr float sample_column_offset(int column) {
  // Bit reversal of the column, so that neighbouring columns have distant offsets.
  const int reversed = ((column & 1) << 2) | (column & 2) | ((column & 4) >> 2);
  return (static_cast<float>(reversed) + 0.5f) / 8.0f;
}

/// What a polygon covers of one pixel.
struct PixelCoverage {
  float area = 0;  // in [0, 1]
  uint64_t samples = 0;
  PICTURA_HD bool is_full() const { return area == 1.0f && samples == kAllSamples; }
};

/// Where a coverage counts as being: its samples; a sliver that touches none is wherever another one is.
PICTURA_HD inline uint64_t reach_of(const PixelCoverage& coverage) {
  return coverage.samples != 0 ? coverage.samples : kAllSamples;
}

/// More than one minus this of a pixel with every sample is all of it.
constexpr float kFullCoverage = 1e-3f;

/// Heights at which an edge's line passes the left and the right side of a pixel, in pixels from its top.
struct Passage {
  float left = 0, right = 0;
};
/// left_px and top_px are the pixel's corner relative to the edge's upper end.
PICTURA_HD inline Passage passage_of(const PolygonEdge& edge, float left_px, float top_px) {
  const float left = left_px * edge.dy_dx - top_px;
  return {left, left + edge.dy_dx};
}

/// For each column of a pixel's samples, the heights (see kRowUnits) between which it is inside of the edges so far.
struct SampleRange {
  Int16x8 low, high;
};
PICTURA_HD inline SampleRange whole_range() {
  constexpr int kFar = 64 * kRowUnits;
  return {make_int16x8([](int) { return -kFar; }), make_int16x8([](int) { return kFar; })};
}

/// Narrows a range to the inner side of an edge.
PICTURA_HD inline void narrow(const PolygonEdge& edge, const Passage& passage, SampleRange* range_inout) {
  constexpr float kWhole = 1 << 8;  // the lowest bit of what is added to it is one of kLines_rows * kRowUnits
  constexpr uint32_t kLowest = 0, kHighest = 0x80008000u;
  const float at = saturate((passage.left + passage.right) * fabsf(edge.rows_scale) + edge.rows_offset);
  const uint32_t height = broadcast_low16(bits_from_float(at + kWhole));
  // Of the sums, one half of 2^15 is the middle, which is 0.
  const Int16x8 columns = arithmetic_sequence(edge.rows_step, (1 << 16) - (1 << 14));
  const bool is_below = edge.rows_scale > 0.0f;
  range_inout->low = add_max(columns, is_below ? height : kLowest, range_inout->low);
  range_inout->high = add_min(columns, is_below ? kHighest : height, range_inout->high);
}

/// The samples within a range.
PICTURA_HD inline uint64_t samples_within(const SampleRange& range) {
  // What is to be added so that whole rows are those whose samples are above.
  const Int16x8 from_top = make_int16x8([](int column) {
    return kSampleRows / 2 * kRowUnits + kRowUnits - 1 -
           static_cast<int>(sample_column_offset(column) * static_cast<float>(kRowUnits));
  });
  const Int16x8 to = add_clamp(range.high, from_top, make_int16x8([](int) { return kSampleRows * kRowUnits; }));
  return bits_between(add_clamp(range.low, from_top, to), to);
}

/// Samples on the inner side of an edge; left_px and top_px are the pixel's corner relative to the edge's upper end.
PICTURA_HD inline uint64_t samples_inside(const PolygonEdge& edge, float left_px, float top_px) {
  SampleRange range = whole_range();
  narrow(edge, passage_of(edge, left_px, top_px), &range);
  return samples_within(range);
}

/// What an edge adds to a polygon's area in a pixel, in the rows that it spans: a right border the area to its left, a
/// left border the same negative, both less what is the same for all edges that end there: the sum over a polygon is
/// its area.
PICTURA_HD inline float area_of(const PolygonEdge& edge, const Passage& passage, float y_px) {
  const float from = saturate(edge.y0 - y_px), to = saturate(edge.y1 - y_px);
  // Between these the edge is within the pixel's width; from the second on, the pixel's whole width is to its left.
  const float left = max_no_nan(min_no_nan(passage.left, to), from);
  const float right = max_no_nan(min_no_nan(passage.right, to), from);
  // Half of the width is where the line has gone half of its way.
  const float width = saturate(((left + right) - (passage.left + passage.right)) * edge.half_dx_dy + 0.5f);
  const float area = (right - left) * width + ((edge.dy_dx > 0.0f ? to : from) - right);
  return edge.rows_scale > 0.0f ? area : -area;
}

/// Area of a convex polygon in pixel (x, y), and the samples that it covers. Edges that do not cross the pixel keep all
/// samples and add their part to the area, so none is asked where it lies.
PICTURA_HD inline PixelCoverage pixel_coverage(const PolygonEdge* edges, int count, float min_area, int x, int y) {
  const float x_px = no_rematerialize(static_cast<float>(x)), y_px = no_rematerialize(static_cast<float>(y));
  float area = 0.0f;
  SampleRange range = whole_range();
  each_edge(edges, count, [&](const PolygonEdge& edge) {
    const Passage passage = passage_of(edge, x_px - edge.x0, y_px - edge.y0);
    area += area_of(edge, passage, y_px);
    narrow(edge, passage, &range);
  });
  if (area < min_area) return {0.0f, 0};
  const uint64_t samples = samples_within(range);
  if (samples == kAllSamples && area > 1.0f - kFullCoverage) return {1.0f, kAllSamples};
  return {min_of(area, 1.0f), samples};
}

/// Range of pixels of row y that the polygon may touch, and within it the range that it covers fully.
struct RowSpan {
  int32_t begin = 0, end = 0, full_begin = 0, full_end = 0;
};

PICTURA_HD inline RowSpan row_span(const PolygonEdge* edges, int count, const PixelBox& box, int y) {
  const float y_px = static_cast<float>(y), middle_px = y_px + 0.5f;
  float touch_low = static_cast<float>(box.x_begin), touch_high = static_cast<float>(box.x_end);
  float full_low = touch_low, full_high = touch_high;
  bool is_beside = false;
  each_edge(edges, count, [&](const PolygonEdge& edge) {
    const float side = side_of(edge);
    if (side == 0.0f) {
      // Level: the row is on one side of it, or it runs through the row.
      const float inner_px = edge.rows_scale > 0.0f ? y_px - edge.y0 : edge.y0 - (y_px + 1.0f);
      if (inner_px <= -1.0f) is_beside = true;
      if (inner_px < 0.0f) full_high = -1.0f;
      return;
    }
    // Where the edge's line passes the row's middle, and how far it goes to both sides from there.
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
  if (is_beside) return {};
  // A little leeway: the exact tests of pixel_coverage decide at the borders.
  constexpr float kLeeway_px = 1e-3f;
  const float begin = static_cast<float>(box.x_begin), end = static_cast<float>(box.x_end);
  auto first_at_or_after = [&](float x) { return static_cast<int>(ceilf(clamp(x, begin, end))); };
  auto first_after = [&](float x) { return static_cast<int>(floorf(clamp(x, begin - 1.0f, end - 1.0f))) + 1; };
  RowSpan span;
  span.begin = first_at_or_after(touch_low - kLeeway_px);
  span.end = max_of(first_after(touch_high + kLeeway_px), span.begin);
  span.full_begin = min_of(max_of(first_at_or_after(full_low + kLeeway_px), span.begin), span.end);
  span.full_end = min_of(max_of(first_after(full_high - kLeeway_px), span.full_begin), span.end);
  return span;
}

}  // namespace pictura
