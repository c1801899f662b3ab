// Face set-up: conversion of a primitive to faces on screen. For host and CUDA code.
#pragma once

#include "pictura/common/portable/intrinsics.h"
#include "pictura/common/raster/clip.h"
#include "pictura/common/raster/compositing.h"
#include "pictura/common/raster/cull.h"
#include "pictura/common/raster/occluders.h"
#include "pictura/common/raster/visibility.h"

namespace pictura {

/// Camera, settings and occluders of one image.
struct ImageSetting {
  PinholeCamera camera;  // in the world
  Frustum frustum;
  float line_floor_px = 0;
  bool debug_palette = false;
  Occluders occluders;
};

/// Object id and class of a face's primitive.
struct PrimitiveRef {
  uint32_t object_id = 0;
  uint8_t class_id = 0;
};
PICTURA_HD constexpr PrimitiveRef agent_ref(const AgentBox& box, int32_t index_in_world) {
  return {make_object_id(kAgentKind, index_in_world),
          static_cast<uint8_t>(static_cast<int>(SurfaceClass::vehicle) + static_cast<int>(box.agent_class))};
}
PICTURA_HD constexpr PrimitiveRef wall_ref(int32_t index) {
  return {make_object_id(kWallKind, index), static_cast<uint8_t>(SurfaceClass::wall)};
}
PICTURA_HD constexpr PrimitiveRef light_ref(int32_t index) {
  return {make_object_id(kLightKind, index), static_cast<uint8_t>(SurfaceClass::light)};
}
PICTURA_HD inline PrimitiveRef strip_ref(const Strip& strip, int32_t index) {
  return {strip_object_id(strip, index), static_cast<uint8_t>(kClassOfStrip + static_cast<int>(strip.kind))};
}

/// Value of the instance plane for a face.
PICTURA_HD constexpr uint16_t instance_of(const ScreenFace& face) {
  return static_cast<uint16_t>(kind_of(face.object_id) == kAgentKind ? 1 + index_of(face.object_id) : 0);
}

/// Minimum area of a face in a pixel. A strip is ignored where it adds less than kMinWeight to every channel. A dark
/// strip's minimum area is limited to kMaxSparedArea, because a larger fragment may occlude a visible part of a bright
/// strip.
constexpr float kMinArea = 1e-4f, kMinWeight = 2.0f / 255.0f, kMaxSparedArea = 0.125f;
PICTURA_HD inline float min_area_of(Rgb color, PrimitiveRef primitive) {
  if (kind_of(primitive.object_id) != kStripKind) return kMinArea;
  const float brightest = max_of(color.r, max_of(color.g, color.b));
  return kMinWeight * reciprocal_in_range(max_of(brightest, kMinWeight / kMaxSparedArea));
}

/// Whether an unclipped face is large enough and not behind an occluder. Sets the winding.
PICTURA_HD inline bool is_quad_visible(const ImageSetting& setting, const ScreenQuad& quad, const FacePlane& plane,
                                       Rgb color, PrimitiveRef primitive, bool* is_clockwise_out) {
  ScreenBounds bounds = quad.bounds;
  if (kind_of(primitive.object_id) == kStripKind && plane.offset > 0.0f) {  // seen from below
    bounds.inverse_depth_high *= nearest_standing(plane_distance_m(plane));
  }
  return find_winding(quad, 2.0f * min_area_of(color, primitive), is_clockwise_out) &&
         !setting.occluders.occludes(setting.camera, bounds);
}

/// Sets the members of a face that depend on its primitive.
PICTURA_HD inline ScreenFace complete_face(const ScreenFace& face, PrimitiveRef primitive, int32_t edge_begin) {
  ScreenFace whole = face;
  if (kind_of(primitive.object_id) == kStripKind) {
    whole.inverse_depth_low *= 1.0f / kWidenedDepth;
    whole.inverse_depth_high *= kWidenedDepth;
    whole.nearest_standing = nearest_standing(whole.plane_distance_m);
  } else {
    whole.nearest_standing = 1.0f;
    whole.plane_distance_m = 0.0f;
  }
  whole.edge_begin = edge_begin;
  whole.object_id = primitive.object_id;
  whole.class_id = primitive.class_id;
  whole.color_bytes = to_bytes(face.color);
  whole.set_min_area(min_area_of(face.color, primitive));
  return whole;
}

/// Clips and projects a face, and stores its edges. pool.take(count) reserves edges and returns the first index, or -1
/// if the pool is full. pool.put(index, edge) stores an edge. Returns false if nothing is visible or the pool is full.
template <typename EdgePool>
PICTURA_HD inline bool make_face(const ImageSetting& setting, PrimitiveRef primitive, const CameraFace& face,
                                 EdgePool& pool, ScreenFace* face_out) {
  int32_t edge_begin = 0;
  auto store_edge = [&](int i, const PolygonEdge& edge) { pool.put(edge_begin + i, edge); };
  ScreenQuad quad;
  const ClipClass clip_class =
      face.count == 4 ? project_quad(setting.camera, face.corners, face.floor_px, &quad) : ClipClass::crossing;
  if (clip_class == ClipClass::outside) return false;
  if (clip_class == ClipClass::inside) {
    bool is_clockwise = false;
    if (!is_quad_visible(setting, quad, face.plane, face.color, primitive, &is_clockwise)) return false;
    edge_begin = pool.take(4);
    if (edge_begin < 0) return false;
    make_quad_face(setting.camera, setting.frustum, quad, is_clockwise, face.plane, face.color, store_edge, face_out);
  } else {
    Vec3 corners[kMaxFaceCorners], polygon[kMaxPolygonCorners];
    int count = face.count;
    if (count == 4) {
      count = widen_in_front(setting.camera, face.floor_px, face.corners, [&](int i, Vec3 p) { corners[i] = p; });
    } else {
      for (int i = 0; i < count; ++i) corners[i] = face.corners[i];
    }
    const int kept = clip_face(setting.frustum, corners, count, polygon);
    if (kept < 3) return false;
    edge_begin = pool.take(kept);
    if (edge_begin < 0 || !make_screen_face<kMaxPolygonCorners>(setting.camera, setting.frustum, polygon, kept,
                                                                face.plane, face.color, store_edge, face_out)) {
      return false;
    }
  }
  *face_out = complete_face(*face_out, primitive, edge_begin);
  return true;
}

/// The front surface at a screen point. Faces that cover the point are added in any order. front() returns the front
/// face, or null. Solids are faces that are not strips. Among equally near solids, and among strips on one level, the
/// lowest object id is in front. is_in_front() then compares the solid with the strip.
class FrontFace {
 public:
  PICTURA_HD void add(const ScreenFace& face, Vec2 at_px) {
    const bool is_of_strip = is_strip(face);
    const ScreenFace*& best = is_of_strip ? strip_ : solid_;
    const ScreenFace* const before = best;
    if (!before || nearer(face, *before, at_px)) best = &face;
    needs_second_pass_ = needs_second_pass_ || (before && (is_of_strip || are_equally_near(face, *before, at_px)));
  }
  /// Whether all faces must be added again, because several may be on one level or equally near.
  PICTURA_HD bool needs_second_pass() const { return needs_second_pass_; }
  PICTURA_HD void add_second_pass(const ScreenFace& face, Vec2 at_px) {
    if (is_strip(face)) {
      if (!of_one_level(face, *strip_, at_px)) return;
      if (!painted_ || face.object_id < painted_->object_id) painted_ = &face;
    } else if (are_equally_near(face, *solid_, at_px)) {
      const bool is_of_one = first_solid_ && face.object_id == first_solid_->object_id;
      const bool is_before =
          is_of_one ? nearer(face, *first_solid_, at_px) : !first_solid_ || face.object_id < first_solid_->object_id;
      if (is_before) first_solid_ = &face;
    }
  }
  template <typename Stands>
  PICTURA_HD const ScreenFace* front(Vec2 at_px, Stands&& stands) const {
    const ScreenFace *const strip = painted_ ? painted_ : strip_, *const solid = first_solid_ ? first_solid_ : solid_;
    if (!solid || !strip) return solid ? solid : strip;
    return is_in_front(*solid, *strip, at_px, stands) ? solid : strip;
  }

 private:
  PICTURA_HD static bool nearer(const ScreenFace& a, const ScreenFace& b, Vec2 at_px) {
    const float inverse_depth_a = clamped_inverse_depth(a, at_px), inverse_depth_b = clamped_inverse_depth(b, at_px);
    return inverse_depth_a != inverse_depth_b ? inverse_depth_a > inverse_depth_b : a.object_id < b.object_id;
  }
  PICTURA_HD static bool are_equally_near(const ScreenFace& a, const ScreenFace& b, Vec2 at_px) {
    return are_equal_depths(clamped_inverse_depth(a, at_px), clamped_inverse_depth(b, at_px));
  }
  const ScreenFace *solid_ = nullptr, *strip_ = nullptr;  // nearest solid and nearest strip
  const ScreenFace* first_solid_ = nullptr;               // lowest object id of equally near solids
  const ScreenFace* painted_ = nullptr;                   // lowest object id on the level of strip_
  bool needs_second_pass_ = false;
};

}  // namespace pictura
