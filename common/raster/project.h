// Conversion of a face in camera coordinates to a polygon on screen. For host and CUDA code.
#pragma once

#include "pictura/common/portable/intrinsics.h"
#include "pictura/common/raster/camera.h"
#include "pictura/common/raster/edges.h"
#include "pictura/common/raster/shapes.h"

namespace pictura {

/// Screen position of a point in front of the near plane.
PICTURA_HD inline Vec2 project(const PinholeCamera& camera, Vec3 p, float inverse_depth) {
  return {camera.center_x_px + camera.focal_x_px * (p.x * inverse_depth),
          camera.center_y_px + camera.focal_y_px * (p.y * inverse_depth)};
}

/// Pixels that a polygon may touch, as half-open ranges.
struct PixelBox {
  int16_t x_begin = 0, x_end = 0, y_begin = 0, y_end = 0;
};

/// A convex polygon on screen, with edges in a pool.
struct alignas(16) ScreenFace {
  PixelBox box;
  int32_t edge_begin = 0;
  uint8_t edge_count = 0;
  uint8_t class_id = 0;
  uint16_t min_area_units = 0;  // see min_area()
  // Inverse depth at a screen point: factors of x and y, and constant term.
  float inverse_depth_x = 0, inverse_depth_y = 0, inverse_depth_0 = 0;
  uint32_t object_id = 0;  // see visibility.h
  // Range of the inverse depth over the corners, widened by kWidenedDepth for strips.
  float inverse_depth_low = 0, inverse_depth_high = 0;
  float nearest_standing = 1;  // see nearest_standing() in visibility.h; 1 except for strips seen from below
  float plane_distance_m = 0;  // height of a strip's plane above the camera; 0 for other faces
  Rgb color;
  uint32_t color_bytes = 0;  // to_bytes(color)

  /// Minimum covered area of a pixel, in px^2. Pixels ignore the face below this area.
  PICTURA_HD float min_area() const { return static_cast<float>(min_area_units) * (1.0f / kAreaUnits); }
  PICTURA_HD void set_min_area(float area) { min_area_units = static_cast<uint16_t>(area * kAreaUnits + 0.5f); }

 private:
  static constexpr float kAreaUnits = 1 << 16;
};
static_assert(sizeof(ScreenFace) == 4 * 16);

/// Bounds of a polygon's corners on screen and of their inverse depths.
struct ScreenBounds {
  Vec2 low{1e30f, 1e30f}, high{-1e30f, -1e30f};
  float inverse_depth_low = 1e30f, inverse_depth_high = 0.0f;
  PICTURA_HD void add(Vec2 corner, float inverse_depth) {
    low = {min_no_nan(low.x, corner.x), min_no_nan(low.y, corner.y)};
    high = {max_no_nan(high.x, corner.x), max_no_nan(high.y, corner.y)};
    inverse_depth_low = min_no_nan(inverse_depth_low, inverse_depth);
    inverse_depth_high = max_no_nan(inverse_depth_high, inverse_depth);
  }
  /// Whether the bounds are within the image enlarged by a margin.
  PICTURA_HD bool are_within(const PinholeCamera& camera, float margin_px) const {
    return low.x >= -margin_px && low.y >= -margin_px && high.x <= static_cast<float>(camera.width_px) + margin_px &&
           high.y <= static_cast<float>(camera.height_px) + margin_px;
  }
  PICTURA_HD Aabb2 in_image(const PinholeCamera& camera) const {
    return {{max_no_nan(low.x, 0.0f), max_no_nan(low.y, 0.0f)},
            {min_no_nan(high.x, static_cast<float>(camera.width_px)),
             min_no_nan(high.y, static_cast<float>(camera.height_px))}};
  }
  PICTURA_HD bool meet_image(const PinholeCamera& camera) const {
    return high.x >= 0.0f && high.y >= 0.0f && low.x < static_cast<float>(camera.width_px) &&
           low.y < static_cast<float>(camera.height_px);
  }
};

/// The bounds must overlap the image and be within the guard band.
PICTURA_HD inline PixelBox pixel_box(const PinholeCamera& camera, const ScreenBounds& bounds) {
  auto pixel_of = [](float at) { return static_cast<int>(floorf(at)); };
  return {static_cast<int16_t>(max_of(pixel_of(bounds.low.x), 0)),
          static_cast<int16_t>(min_of(pixel_of(bounds.high.x) + 1, camera.width_px)),
          static_cast<int16_t>(max_of(pixel_of(bounds.low.y), 0)),
          static_cast<int16_t>(min_of(pixel_of(bounds.high.y) + 1, camera.height_px))};
}

/// Smaller polygons are dropped.
constexpr float kMinTwiceArea_px2 = 1e-6f;

/// False for faces without area and for planes through the camera.
PICTURA_HD inline bool has_inverse_depth(const FacePlane& plane) {
  constexpr float kMinMagnitude = 1e-30f;
  return dot(plane.normal, plane.normal) > kMinMagnitude && fabsf(plane.offset) > kMinMagnitude;
}
/// Inverse depth of a plane: factors of x and y on screen, and constant term.
PICTURA_HD inline Vec3 inverse_depth_plane(const PinholeCamera& camera, const Frustum& f, const FacePlane& plane) {
  const Vec3 inverse = plane.normal * (has_inverse_depth(plane) ? reciprocal_in_range(plane.offset) : 0.0f);
  const float x = inverse.x * f.x_per_px, y = inverse.y * f.y_per_px;
  return {x, y, inverse.z - x * camera.center_x_px - y * camera.center_y_px};
}

/// Signed distance of a plane from the camera along its normal; 0 if has_inverse_depth() is false.
PICTURA_HD inline float plane_distance_m(const FacePlane& plane) {
  return has_inverse_depth(plane) ? plane.offset * reciprocal_in_range(sqrt_in_range(dot(plane.normal, plane.normal)))
                                  : 0.0f;
}

/// Sets members that depend on a face's plane and bounds. The bounds must overlap the image.
PICTURA_HD inline void set_bounds(const PinholeCamera& camera, const Frustum& f, const ScreenBounds& bounds,
                                  const FacePlane& plane, ScreenFace* face_out) {
  face_out->box = pixel_box(camera, bounds);
  face_out->inverse_depth_low = bounds.inverse_depth_low;
  face_out->inverse_depth_high = bounds.inverse_depth_high;
  const Vec3 inverse_depth = inverse_depth_plane(camera, f, plane);
  face_out->inverse_depth_x = inverse_depth.x;
  face_out->inverse_depth_y = inverse_depth.y;
  face_out->inverse_depth_0 = inverse_depth.z;
  face_out->plane_distance_m = plane_distance_m(plane);
}

/// Projects a clipped face. complete_face() sets the remaining members of face_out. Returns false if the face covers
/// nothing. See make_edges() for store_edge.
template <int kMaxCorners, typename Corners, typename StoreEdge>
PICTURA_HD inline bool make_screen_face(const PinholeCamera& camera, const Frustum& f, const Corners& polygon,
                                        int count, const FacePlane& plane, Rgb color, StoreEdge&& store_edge,
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
  face_out->edge_count = static_cast<uint8_t>(make_edges(corner, count, twice_area > 0.0f, store_edge));
  face_out->color = color;
  set_bounds(camera, f, bounds, plane, face_out);
  return true;
}

struct ScreenQuad {
  Vec2 corner[4];
  ScreenBounds bounds;
};

/// Position of a face: outside the image, inside the guard band (drawn unchanged), or crossing it (clipped).
enum class ClipClass : uint8_t { outside, inside, crossing };

/// Projects a face of four corners, and widens strips to at least floor_px on screen.
PICTURA_HD inline ClipClass project_quad(const PinholeCamera& camera, const Vec3* corners, float floor_px,
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
  const bool is_inside_guard_band = bounds->are_within(camera, kGuardBand_px);
  // The bounds are meaningless for a face that extends behind the near plane.
  if (nearest_m < kNear_m) return ClipClass::crossing;
  return !bounds->meet_image(camera) ? ClipClass::outside
                                     : (is_inside_guard_band ? ClipClass::inside : ClipClass::crossing);
}

/// Sets the winding of a face. Returns false if its area is too small.
PICTURA_HD inline bool find_winding(const ScreenQuad& quad, float min_twice_area_px2, bool* is_clockwise_out) {
  const float twice_area = cross(quad.corner[2] - quad.corner[0], quad.corner[3] - quad.corner[1]);
  *is_clockwise_out = twice_area > 0.0f;
  return fabsf(twice_area) >= min_twice_area_px2;
}

/// Variant of make_screen_face() for a quad that is inside the guard band and that find_winding() accepted.
template <typename StoreEdge>
PICTURA_HD inline void make_quad_face(const PinholeCamera& camera, const Frustum& f, const ScreenQuad& quad,
                                      bool is_clockwise, const FacePlane& plane, Rgb color, StoreEdge&& store_edge,
                                      ScreenFace* face_out) {
  face_out->edge_count = static_cast<uint8_t>(make_edges(quad.corner, 4, is_clockwise, store_edge));
  face_out->color = color;
  set_bounds(camera, f, quad.bounds, plane, face_out);
}

/// 1 / depth of a face's plane; negative if the plane is behind the camera.
PICTURA_HD inline float inverse_depth(const ScreenFace& face, Vec2 at_px) {
  return face.inverse_depth_0 + face.inverse_depth_x * at_px.x + face.inverse_depth_y * at_px.y;
}

}  // namespace pictura
