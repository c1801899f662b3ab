// Occlusion culling: faces behind an occluder are not drawn. For host and CUDA code.
#pragma once

#include "pictura/common/portable/intrinsics.h"
#include "pictura/common/raster/coverage.h"
#include "pictura/common/raster/cull.h"

namespace pictura {

/// Face of a wall or box on screen, in front of the near plane.
struct alignas(16) Occluder {
  Vec3 side[4];        // distance in px from each side, positive inside: factors of x and y, constant term
  Vec3 inverse_depth;  // factors of x and y, constant term
};

/// Maximum depth of occluders.
constexpr float kOccluderRange_m = 45.0f;
PICTURA_HD inline bool may_occlude(const AgentBox& box, const PinholeCamera& camera) {
  return to_camera(camera, box.center_m).z - 0.5f * box.length_m < kOccluderRange_m;
}
PICTURA_HD inline bool may_occlude(const WallFace& wall, const PinholeCamera& camera) {
  return to_camera(camera, wall_middle(wall)).z - wall_radius_m(wall) < kOccluderRange_m;
}

/// Twice the minimum area of an occluder, and the minimum length by which its sides' normals are divided.
constexpr float kMinOccluder_px2 = 1.0f, kMinSide_px = 1e-3f;
/// Maximum distance of an occluder's corners from the image, for precision.
constexpr float kMaxOccluder_px = 4096.0f;
/// Margins against rounding: minimum distance from the occluder's sides, and minimum ratio of depths.
constexpr float kOccluderMargin_px = 0.05f, kOccluderDepthFactor = 1.002f;

/// Area of a face's bounding box within the image, by which occluders are chosen. Returns 0 if the face cannot occlude.
/// Otherwise sets the face on screen and its winding.
PICTURA_HD inline float occluder_area_px2(const PinholeCamera& camera, const CameraQuad& face, ScreenQuad* quad_out,
                                          bool* is_clockwise_out) {
  const float nearest_m =
      min_no_nan(min_no_nan(face.corner[0].z, face.corner[1].z), min_no_nan(face.corner[2].z, face.corner[3].z));
  if (nearest_m < kNear_m || project_quad(camera, face.corner, 0.0f, quad_out) == ClipClass::outside) return 0.0f;
  const bool is_near = quad_out->bounds.are_within(camera, kMaxOccluder_px);
  if (!find_winding(*quad_out, kMinOccluder_px2, is_clockwise_out) || !is_near) return 0.0f;
  const Aabb2 in_image = quad_out->bounds.in_image(camera);
  return (in_image.high.x - in_image.low.x) * (in_image.high.y - in_image.low.y);
}

/// Makes the occluder of a face with a positive occluder_area_px2().
PICTURA_HD inline Occluder make_occluder(const PinholeCamera& camera, const Frustum& f, const FacePlane& plane,
                                         const ScreenQuad& quad, bool is_clockwise) {
  Occluder occluder;
  const float sign = is_clockwise ? 1.0f : -1.0f;
  for (int i = 0; i < 4; ++i) {
    const Vec2 from = quad.corner[i], along = quad.corner[(i + 1) % 4] - from;
    const Vec2 inward = Vec2{-along.y, along.x} * (sign * reciprocal_in_range(max_no_nan(length(along), kMinSide_px)));
    occluder.side[i] = {inward.x, inward.y, -(inward.x * from.x + inward.y * from.y)};
  }
  occluder.inverse_depth = inverse_depth_plane(camera, f, plane);
  return occluder;
}

/// The occluders of an image: the faces of largest area. Among equals, the lowest face_entry() is chosen.
struct Occluders {
  static constexpr int kMaxCount = 4;
  int32_t count = 0;
  Occluder occluder[kMaxCount];

  /// Whether one occluder hides a face with these bounds.
  PICTURA_HD bool occludes(const PinholeCamera& camera, const ScreenBounds& bounds) const {
    const Aabb2 box = bounds.in_image(camera);
    // Minimum of a linear function over the box.
    auto min_over_box = [&](Vec3 of) {
      return of.x * (of.x > 0.0f ? box.low.x : box.high.x) + of.y * (of.y > 0.0f ? box.low.y : box.high.y) + of.z;
    };
    const float inverse_depth = bounds.inverse_depth_high * kOccluderDepthFactor;
    bool is_occluded = false;
    PICTURA_NO_UNROLL
    for (int k = 0; k < count; ++k) {
      const Occluder one = occluder[k];
      float inside_px = min_over_box(one.side[0]);
      for (int i = 1; i < 4; ++i) inside_px = min_no_nan(inside_px, min_over_box(one.side[i]));
      is_occluded =
          is_occluded || (inside_px >= kOccluderMargin_px && min_over_box(one.inverse_depth) >= inverse_depth);
    }
    return is_occluded;
  }
};

}  // namespace pictura
