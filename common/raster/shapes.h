// Conversion of primitives to faces: convex polygons in camera coordinates, with colours that fade with depth. For host
// and CUDA code.
#pragma once

#include "pictura/common/portable/intrinsics.h"
#include "pictura/common/raster/camera.h"

namespace pictura {

/// Class of the front surface at a pixel's centre.
enum class SurfaceClass : uint8_t { nothing, vehicle, cyclist, pedestrian, wall, light, strip };
/// First class of strips, see StripKind.
constexpr int kClassOfStrip = static_cast<int>(SurfaceClass::strip);

/// Sides of the polygon that represents a light's disk.
constexpr int kLightSides = 24;
/// Maximum number of corners of a face before clipping.
constexpr int kMaxFaceCorners = kLightSides;

/// Plane in camera coordinates: normal . p = offset. The normal may have any length.
struct FacePlane {
  Vec3 normal;
  float offset = 0;
};
PICTURA_HD inline FacePlane quad_plane(const Vec3* corners) {
  const Vec3 normal = cross(corners[2] - corners[0], corners[3] - corners[1]);
  return {normal, dot(normal, corners[0])};
}

/// Brightness of a face: 1 minus the mean of its corners' depths, each as a share of kVisibleRange_m clamped to [0, 1].
/// A face with brightness 0 is not drawn and occludes nothing.
PICTURA_HD inline float face_brightness(const Vec3* corners, int count) {
  float faded = 0.0f;
  PICTURA_UNROLL_FOUR
  for (int i = 0; i < count; ++i) faded += saturate(corners[i].z * (1.0f / kVisibleRange_m));
  return 1.0f - faded / static_cast<float>(count);
}

struct CameraFace {
  const Vec3* corners = nullptr;
  int count = 0;
  FacePlane plane;
  Rgb color;
  float floor_px = 0;  // minimum width of a strip, not yet applied; other faces: 0
};

/// Colour before fading. The debug palette tints halted agents white and parked agents grey.
PICTURA_HD inline Rgb agent_face_color(const AgentBox& box, BoxFace face, bool debug_palette) {
  const Rgb color = agent_color(box.agent_class, face);
  if (!debug_palette || box.palette == 0) return color;
  const float tint = box.palette == 1 ? 1.0f : 0.35f;
  return {0.5f * (color.r + tint), 0.5f * (color.g + tint), 0.5f * (color.b + tint)};
}

/// Faces of a cuboid: those of BoxFace, and the underside, which is visible from below a bridge.
constexpr int kUnderside = kNumBoxFaces, kNumCuboidFaces = kNumBoxFaces + 1;

/// Bit mask of the faces of a box that face a camera at eye_m.
PICTURA_HD inline unsigned front_facing_mask(const AgentBox& box, Vec3 eye_m) {
  const Vec2 ahead{box.cos_heading, box.sin_heading};
  const Vec2 from_center = eye_m.xy() - box.center_m.xy();
  const float ahead_m = dot(from_center, ahead), left_m = cross(ahead, from_center);
  auto bit_of = [](bool is_turned, BoxFace face) { return is_turned ? 1u << static_cast<int>(face) : 0u; };
  return bit_of(ahead_m > 0.5f * box.length_m, BoxFace::front) | bit_of(ahead_m < -0.5f * box.length_m, BoxFace::back) |
         bit_of(left_m > 0.5f * box.width_m, BoxFace::left) | bit_of(left_m < -0.5f * box.width_m, BoxFace::right) |
         bit_of(eye_m.z > box.center_m.z + box.height_m, BoxFace::top) |
         (eye_m.z < box.center_m.z ? 1u << kUnderside : 0u);
}

/// Corners of a box's face, in world coordinates. The box's corners 0 to 3 are front left, rear left, rear right and
/// front right on the ground. Corners 4 to 7 are above them.
PICTURA_HD inline void cuboid_face_corners(const AgentBox& box, int face, Vec3* corners_out) {
  const Vec2 ahead{box.cos_heading, box.sin_heading};
  const Vec2 along = ahead * (0.5f * box.length_m), across = left_normal(ahead) * (0.5f * box.width_m);
  const Vec2 center = box.center_m.xy();
  auto corner = [&](int i) {
    const Vec2 at_end = (i & 3) == 0 || (i & 3) == 3 ? center + along : center - along;
    const Vec2 ground = (i & 3) < 2 ? at_end + across : at_end - across;
    return Vec3{ground.x, ground.y, i < 4 ? box.center_m.z : box.center_m.z + box.height_m};
  };
  // Three bits per corner, from the lowest.
  constexpr int kFrontCorners = 07403, kBackCorners = 05621, kLeftCorners = 04510, kRightCorners = 06732,
                kTopCorners = 07654, kUndersideCorners = 00123;
  int corners = kUndersideCorners;
  switch (face) {
    case static_cast<int>(BoxFace::front): corners = kFrontCorners; break;
    case static_cast<int>(BoxFace::back): corners = kBackCorners; break;
    case static_cast<int>(BoxFace::left): corners = kLeftCorners; break;
    case static_cast<int>(BoxFace::right): corners = kRightCorners; break;
    case static_cast<int>(BoxFace::top): corners = kTopCorners; break;
    default: break;
  }
  for (int i = 0; i < 4; ++i) corners_out[i] = corner(corners >> (3 * i) & 7);
}

/// A face in world coordinates, with its colour before fading.
struct WorldQuad {
  Vec3 corner[4];
  Rgb color;
};

PICTURA_HD inline WorldQuad cuboid_quad(const AgentBox& box, int face, bool debug_palette) {
  const BoxFace painted = face == kUnderside ? BoxFace::top : static_cast<BoxFace>(face);
  WorldQuad quad;
  cuboid_face_corners(box, face, quad.corner);
  quad.color = agent_face_color(box, painted, debug_palette);
  return quad;
}

PICTURA_HD inline WorldQuad wall_quad(const WallFace& wall) {
  const Vec3 up{0.0f, 0.0f, wall.height_m};
  return {{wall.a_m, wall.b_m, wall.b_m + up, wall.a_m + up}, wall.color};
}

/// A face in camera coordinates, with its faded colour. Strips are not yet widened.
struct CameraQuad {
  Vec3 corner[4];
  FacePlane plane;
  Rgb color;
};

/// Transforms a quad to camera coordinates. Returns false if it has faded to black.
PICTURA_HD inline bool quad_to_camera(const WorldQuad& quad, const PinholeCamera& camera, CameraQuad* quad_out) {
  for (int i = 0; i < 4; ++i) quad_out->corner[i] = to_camera(camera, quad.corner[i]);
  const float brightness = face_brightness(quad_out->corner, 4);
  quad_out->plane = quad_plane(quad_out->corner);
  quad_out->color = quad.color * brightness;
  return brightness > 0.0f;
}

/// The result points to the quad's corners. floor_px must be 0 unless the quad is a strip.
PICTURA_HD inline CameraFace make_camera_face(const CameraQuad& quad, float floor_px) {
  return {quad.corner, 4, quad.plane, quad.color, floor_px};
}

/// Calls emit(face) unless the quad has faded to black.
template <typename Emit>
PICTURA_HD inline void emit_quad(const WorldQuad& quad, const PinholeCamera& camera, float floor_px, Emit&& emit) {
  CameraQuad in_camera;
  if (quad_to_camera(quad, camera, &in_camera)) emit(make_camera_face(in_camera, floor_px));
}

/// Calls visit(face) for each front-facing face.
template <typename Visit>
PICTURA_HD inline void visit_front_facing(const AgentBox& box, const PinholeCamera& camera, Visit&& visit) {
  const unsigned faces = front_facing_mask(box, camera.position_m);
  for (int face = 0; face < kNumCuboidFaces; ++face) {
    if ((faces >> face & 1u) != 0) visit(face);
  }
}

/// Calls emit(face) for each front-facing face that has not faded to black.
template <typename Emit>
PICTURA_HD inline void agent_faces(const AgentBox& box, const PinholeCamera& camera, bool debug_palette, Emit&& emit) {
  visit_front_facing(box, camera,
                     [&](int face) { emit_quad(cuboid_quad(box, face, debug_palette), camera, 0.0f, emit); });
}

template <typename Emit>
PICTURA_HD inline void wall_faces(const WallFace& wall, const PinholeCamera& camera, Emit&& emit) {
  emit_quad(wall_quad(wall), camera, 0.0f, emit);
}

/// Whether position_m is within a light head's half-angle and the light's state is known.
PICTURA_HD inline bool light_is_visible(const LightHead& head, LightState state, Vec3 position_m) {
  if (state == LightState::unknown) return false;
  const Vec2 to_eye = position_m.xy() - head.position_m.xy();
  const float ahead_m = dot(to_eye, head.facing);
  // Compares squares, without a square root.
  const float cosine = max_no_nan(head.cos_half_angle, 0.0f);
  return ahead_m > 0.0f && ahead_m * ahead_m >= cosine * cosine * dot(to_eye, to_eye);
}

/// Corner of the polygon of a light head, in world coordinates.
PICTURA_HD inline Vec3 light_corner(const LightHead& head, int corner) {
  constexpr float kRadius_m = kLightRadius_m * 1.00574110f;  // sqrt(a / sin(a)), a = 2 pi / kLightSides
  const SinCos at = sincos_of(static_cast<float>(corner) * (kTwoPi / kLightSides));
  const Vec2 ground = head.position_m.xy() + left_normal(head.facing) * (kRadius_m * at.cos);
  return {ground.x, ground.y, head.position_m.z + kRadius_m * at.sin};
}

/// Disk of a light head, in camera coordinates, with its faded colour.
struct LightDisk {
  FacePlane plane;
  Rgb color;
};
/// Returns false if the head has faded to black.
PICTURA_HD inline bool light_to_camera(const LightHead& head, LightState state, const PinholeCamera& camera,
                                       LightDisk* disk_out) {
  const Vec3 middle = to_camera(camera, head.position_m), facing{head.facing.x, head.facing.y, 0.0f};
  const Vec3 normal{dot(camera.right, facing), dot(camera.down, facing), dot(camera.forward, facing)};
  const float brightness = face_brightness(&middle, 1);
  *disk_out = {{normal, dot(normal, middle)}, light_color(state) * brightness};
  return brightness > 0.0f;
}

/// Calls emit(face) for the disk of a visible light head.
template <typename Emit>
PICTURA_HD inline void light_faces(const LightHead& head, LightState state, const PinholeCamera& camera, Emit&& emit) {
  if (!light_is_visible(head, state, camera.position_m)) return;
  LightDisk disk;
  if (!light_to_camera(head, state, camera, &disk)) return;
  Vec3 corners[kLightSides];
  for (int i = 0; i < kLightSides; ++i) corners[i] = to_camera(camera, light_corner(head, i));
  emit(CameraFace{corners, kLightSides, disk.plane, disk.color});
}

/// Computes corners in world coordinates: left of a, right of a, right of b, left of b.
PICTURA_HD inline void strip_corners(const Strip& strip, Vec3* corners_out) {
  const Vec2 at_a = strip.side_a * (0.5f * strip.width_m), at_b = strip.side_b * (0.5f * strip.width_m);
  const Vec3 a = strip.a_m, b = strip.b_m;
  corners_out[0] = {a.x + at_a.x, a.y + at_a.y, a.z};
  corners_out[1] = {a.x - at_a.x, a.y - at_a.y, a.z};
  corners_out[2] = {b.x - at_b.x, b.y - at_b.y, b.z};
  corners_out[3] = {b.x + at_b.x, b.y + at_b.y, b.z};
}

/// Widening of a strip on screen, perpendicular to the strip.
struct Widening {
  Vec2 across;  // unit vector from right to left; 0 if the strip is a point on screen
  float floor_px = 0;
  /// Displacement of the left corner of a strip's end. The right corner moves in the opposite direction. gap_px leads
  /// from the right corner to the left.
  PICTURA_HD Vec2 push_px(Vec2 gap_px) const {
    const float width_px = dot(gap_px, across);
    const float missing_px = 0.5f * max_no_nan(floor_px - fabsf(width_px), 0.0f);
    return across * (width_px < 0.0f ? -missing_px : missing_px);
  }
};

/// Widening of a strip whose centre line runs from a to b (camera coordinates). Both may be scaled by a common factor.
/// One end may be behind the camera.
PICTURA_HD inline Widening widening_of(const PinholeCamera& camera, float floor_px, Vec3 a, Vec3 b) {
  // Direction on screen, times the product of both depths.
  const Vec2 ahead{camera.focal_x_px * (b.x * a.z - a.x * b.z), camera.focal_y_px * (b.y * a.z - a.y * b.z)};
  constexpr float kLeast = 1e-12f;  // its square still has a finite reciprocal
  const float length2 = dot(ahead, ahead), min_length = max_no_nan(1e-6f * fabsf(a.z * b.z), kLeast);
  if (!(length2 > min_length * min_length)) return {};
  return {left_normal(ahead) * sqrt_in_range(reciprocal_in_range(length2)), floor_px};
}

/// Moves the corners of one end of a strip apart to the minimum width. Does nothing if a corner is closer than the near
/// plane.
PICTURA_HD inline void widen_strip_end(const PinholeCamera& camera, const Widening& widening, Vec3* left, Vec3* right) {
  if (left->z < kNear_m || right->z < kNear_m) return;
  const float of_left = reciprocal_in_range(left->z), of_right = reciprocal_in_range(right->z);
  const Vec2 push_px = widening.push_px({camera.focal_x_px * (left->x * of_left - right->x * of_right),
                                         camera.focal_y_px * (left->y * of_left - right->y * of_right)});
  const Vec2 push{push_px.x * reciprocal_in_range(camera.focal_x_px),
                  push_px.y * reciprocal_in_range(camera.focal_y_px)};
  left->x += push.x * left->z;
  left->y += push.y * left->z;
  right->x -= push.x * right->z;
  right->y -= push.y * right->z;
}

/// Widens a strip in camera coordinates, before clipping.
PICTURA_HD inline void widen_strip(const PinholeCamera& camera, float floor_px, Vec3* corners) {
  const Widening widening = widening_of(camera, floor_px, corners[0] + corners[1], corners[3] + corners[2]);
  widen_strip_end(camera, widening, &corners[0], &corners[1]);
  widen_strip_end(camera, widening, &corners[3], &corners[2]);
}

PICTURA_HD inline WorldQuad strip_quad(const Strip& strip) {
  WorldQuad quad;
  strip_corners(strip, quad.corner);
  quad.color = strip.color;
  return quad;
}

/// Calls emit(face) for a strip's face, not yet widened.
template <typename Emit>
PICTURA_HD inline void strip_faces(const Strip& strip, const PinholeCamera& camera, float floor_px, Emit&& emit) {
  emit_quad(strip_quad(strip), camera, floor_px, emit);
}

/// Strips are on one level if their heights differ by less than this. strip_rank() then decides which is in front.
constexpr float kSameLevel_m = 0.05f;
/// A strip's depth is clamped to the range of its corners' depths, widened by this factor. Close to the strip's plane,
/// the depth would otherwise vary without bound within a pixel.
constexpr float kWidenedDepth = 2.0f;
/// Relative difference below which depths are equal, so that rounding does not order faces in one plane.
constexpr float kEqualDepth = 1e-4f;
/// A solid (box, wall or light) stands on a strip if both overlap on the ground plane and the centre of the solid's
/// base is at most this far from the strip's plane. Upright boxes cut into slopes, so the distance is not 0.
constexpr float kStanding_m = 0.5f;
/// Maximum distance by which solids extend below the strip on which they stand. Only culling uses it.
constexpr float kThroughStrip_m = 4.0f * kStanding_m;

/// Where strips on one level overlap, the lower rank is in front.
PICTURA_HD constexpr int strip_rank(StripKind kind) {
  // Two bits per kind, from the lowest.
  constexpr int kRanks = 2 | 3 << 2 | 1 << 4 | 0 << 6;
  return kRanks >> (2 * static_cast<int>(kind)) & 3;
}

}  // namespace pictura
