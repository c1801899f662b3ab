// Clipping of faces in camera coordinates to the near plane and the guard band. For host and CUDA code.
#pragma once

#include "pictura/common/portable/intrinsics.h"
#include "pictura/common/raster/camera.h"
#include "pictura/common/raster/shapes.h"

namespace pictura {

/// Each of the five planes adds at most one corner. The sixth place is spare, because clip_face() reserves two places
/// for each side.
constexpr int kMaxPolygonCorners = kMaxFaceCorners + 6;

/// A plane of the frustum: the near plane or one of four sides. inside() is negative outside. Its unit depends on the
/// plane. All planes evaluate the same terms, so that lanes of a warp do not diverge.
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

/// Bit mask of the planes for which a point is outside.
PICTURA_HD inline unsigned planes_outside(const Frustum& f, Vec3 p) {
  unsigned outside = 0;
  for (int plane = 0; plane < kClipPlanes; ++plane) {
    if (ClipPlane(f, plane).inside(p) < 0.0f) outside |= 1u << plane;
  }
  return outside;
}

/// Bit mask of the planes that a face crosses, or kOutside if the face is entirely outside one plane.
constexpr unsigned kOutside = ~0u;
template <typename Corners>
PICTURA_HD inline unsigned planes_crossed(const Frustum& f, const Corners& corners, int count) {
  unsigned outside_of_any = 0, outside_of_all = ~0u;
  PICTURA_UNROLL_FOUR
  for (int i = 0; i < count; ++i) {
    const unsigned outside = planes_outside(f, corners[i]);
    outside_of_any |= outside;
    outside_of_all &= outside;
  }
  return outside_of_all != 0 ? kOutside : outside_of_any;
}

/// Intersection of the side from a to b with a plane, given inside() of both ends. It is computed from the inner end,
/// so that faces with a common side get the same point.
PICTURA_HD inline Vec3 cut_between(Vec3 a, float a_inside, Vec3 b, float b_inside) {
  const bool a_is_inner = a_inside >= 0.0f;
  const Vec3 inner = a_is_inner ? a : b, outer = a_is_inner ? b : a;
  const float inside = a_is_inner ? a_inside : b_inside, outside = a_is_inner ? b_inside : a_inside;
  return inner + (outer - inner) * (inside * reciprocal_in_range(inside - outside));
}

constexpr int kMaxWidenedCorners = 5;
/// Widens a strip to at least floor_px on screen. If the strip crosses the near plane, cuts the strip there and widens
/// only its far end. If floor_px is 0, the corners do not change. Calls emit(i, corner) and returns the number of
/// corners.
template <typename Emit>
PICTURA_HD inline int widen_in_front(const PinholeCamera& camera, float floor_px, const Vec3* corners, Emit&& emit) {
  Vec3 widened[4];
  for (int i = 0; i < 4; ++i) widened[i] = corners[i];
  if (floor_px > 0.0f) widen_strip(camera, floor_px, widened);
  int count = 0;
  for (int i = 0; i < 4; ++i) {
    const Vec3 previous = corners[(i + 3) % 4], current = corners[i];
    const float previous_inside = previous.z - kNear_m, inside = current.z - kNear_m;
    if (floor_px > 0.0f && (previous_inside >= 0.0f) != (inside >= 0.0f)) {
      Vec3 cut = cut_between(previous, previous_inside, current, inside);
      cut.z = kNear_m;
      emit(count++, cut);
    }
    if (floor_px <= 0.0f || inside >= 0.0f) emit(count++, widened[i]);
  }
  return count;
}

/// Clips a convex face. Writes at most kMaxPolygonCorners corners and returns their number. Below 3 corners, nothing is
/// left.
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
  // The buffers alternate, so that the last plane writes to polygon_out.
  PICTURA_NO_UNROLL
  for (int number = 0; number < kClipPlanes; ++number) {
    if (!((crossed >> number) & 1u)) continue;
    const ClipPlane plane(f, number);
    Vec3* to = (remaining_planes & 1) ? polygon_out : buffer;
    int kept = 0;
    Vec3 previous = from[count - 1];
    float previous_inside = plane.inside(previous);
    // Only a face that is not exactly convex exceeds the maximum.
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

}  // namespace pictura
