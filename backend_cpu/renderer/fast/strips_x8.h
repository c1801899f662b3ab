// Set-up of eight strips in parallel (SIMD): the steps of common/raster from strip_quad() to is_quad_visible(), without
// edges.
#pragma once

#include <cstddef>

#include "pictura/backend_cpu/renderer/fast/cull_x8.h"
#include "pictura/common/raster/face_setup.h"

namespace pictura {

struct StripsX8 {
  unsigned visible = 0;   // lanes of strips that need no clipping, are large enough and are not occluded
  unsigned crossing = 0;  // lanes of strips that must be clipped first
  unsigned clockwise = 0;
  Vec2x8 corner[4];
  Vec2x8 low, high;  // bounds on screen
  Float8 inverse_depth_low, inverse_depth_high;
  Vec3x8 normal;
  Float8 offset;
  Vec3x8 color;  // red, green, blue

  ScreenQuad quad(int lane) const {
    ScreenQuad quad;
    for (int i = 0; i < 4; ++i) quad.corner[i] = {corner[i].x[lane], corner[i].y[lane]};
    quad.bounds = {
        {low.x[lane], low.y[lane]}, {high.x[lane], high.y[lane]}, inverse_depth_low[lane], inverse_depth_high[lane]};
    return quad;
  }
  FacePlane plane(int lane) const { return {{normal.x[lane], normal.y[lane], normal.z[lane]}, offset[lane]}; }
  Rgb color_of(int lane) const { return {color.x[lane], color.y[lane], color.z[lane]}; }
};

/// Versions of widening_of() and Widening::push_px() for eight strips.
struct WideningX8 {
  Vec2x8 across;
  float floor_px;
  WideningX8(const PinholeCamera& camera, float min_width_px, const Vec3x8& a, const Vec3x8& b)
      : floor_px(min_width_px) {
    const Vec2x8 ahead{camera.focal_x_px * (b.x * a.z - a.x * b.z), camera.focal_y_px * (b.y * a.z - a.y * b.z)};
    const Float8 length2 = dot(ahead, ahead), min_length = max_no_nan(1e-6f * magnitude(a.z * b.z), 1e-12f);
    const Float8 scale = sqrt_in_range(reciprocal_in_range(length2));
    const Mask8 is_long = length2 > min_length * min_length;
    across = {select(is_long, -ahead.y * scale, 0.0f), select(is_long, ahead.x * scale, 0.0f)};
  }
  Vec2x8 push_px(const Vec2x8& gap_px) const {
    const Float8 width_px = dot(gap_px, across);
    const Float8 missing_px = 0.5f * max_no_nan(floor_px - magnitude(width_px), 0.0f);
    return across * select(width_px < 0.0f, -missing_px, missing_px);
  }
};

/// Versions of plane_distance_m() and nearest_standing() for eight planes.
inline Float8 nearest_standing(const Vec3x8& normal, Float8 offset) {
  constexpr float kMinMagnitude = 1e-30f;
  const Float8 length2 = dot(normal, normal);
  const Mask8 has_distance = (length2 > kMinMagnitude) & (offset > kMinMagnitude);
  if (bits_of(has_distance) == 0) return 1.0f;
  const Float8 distance_m = offset * reciprocal_in_range(sqrt_in_range(length2));
  const Float8 nearest =
      select(distance_m > kThroughStrip_m, distance_m * reciprocal_in_range(distance_m - kThroughStrip_m),
             float_from_bits(0x7F800000u));
  return select(has_distance & (distance_m > 0.0f), nearest, 1.0f);
}

/// Version of Occluders::occludes() for eight bounds.
inline Mask8 occludes(const Occluders& occluders, const PinholeCamera& camera, const StripsX8& strips,
                      Float8 inverse_depth_high) {
  const Vec2x8 low{max_no_nan(strips.low.x, 0.0f), max_no_nan(strips.low.y, 0.0f)};
  const Vec2x8 high{min_no_nan(strips.high.x, static_cast<float>(camera.width_px)),
                    min_no_nan(strips.high.y, static_cast<float>(camera.height_px))};
  auto min_over_box = [&](Vec3 of) {
    return of.x * (of.x > 0.0f ? low.x : high.x) + of.y * (of.y > 0.0f ? low.y : high.y) + of.z;
  };
  const Float8 inverse_depth = inverse_depth_high * kOccluderDepthFactor;
  Mask8 are_occluded = Float8(0.0f) < 0.0f;
  for (int k = 0; k < occluders.count; ++k) {
    const Occluder& one = occluders.occluder[k];
    Float8 inside_px = min_over_box(one.side[0]);
    for (int i = 1; i < 4; ++i) inside_px = min_no_nan(inside_px, min_over_box(one.side[i]));
    are_occluded =
        are_occluded | ((inside_px >= kOccluderMargin_px) & (min_over_box(one.inverse_depth) >= inverse_depth));
  }
  return are_occluded;
}

inline StripsX8 set_up_strips(const ImageSetting& setting, const Strip* const* strip) {
  static_assert(offsetof(Strip, color) == 11 * sizeof(float));
  Float8 member[16];
  for (int first : {0, 4, 8, 12}) {
    gather_fours(
        [&](int lane) -> const void* { return reinterpret_cast<const char*>(strip[lane]) + first * sizeof(float); },
        &member[first]);
  }
  const PinholeCamera& camera = setting.camera;
  const Vec3x8 a_m{member[0], member[1], member[2]}, b_m{member[3], member[4], member[5]};
  const Float8 half_width_m = 0.5f * member[10];

  // strip_corners() and quad_to_camera()
  const Vec2x8 at_a = Vec2x8{member[6], member[7]} * half_width_m, at_b = Vec2x8{member[8], member[9]} * half_width_m;
  const Vec3x8 corner[4] = {to_camera(camera, {a_m.x + at_a.x, a_m.y + at_a.y, a_m.z}),
                            to_camera(camera, {a_m.x - at_a.x, a_m.y - at_a.y, a_m.z}),
                            to_camera(camera, {b_m.x - at_b.x, b_m.y - at_b.y, b_m.z}),
                            to_camera(camera, {b_m.x + at_b.x, b_m.y + at_b.y, b_m.z})};
  Float8 faded = 0.0f;
  for (const Vec3x8& p : corner) faded = faded + saturate(p.z * (1.0f / kVisibleRange_m));
  const Float8 brightness = 1.0f - faded / 4.0f;
  const Mask8 is_bright = brightness > 0.0f;

  StripsX8 strips;
  strips.color = {member[11] * brightness, member[12] * brightness, member[13] * brightness};
  strips.normal = cross(corner[2] - corner[0], corner[3] - corner[1]);
  strips.offset = dot(strips.normal, corner[0]);

  // project_quad()
  const Float8 nearest_m = min_no_nan(min_no_nan(corner[0].z, corner[1].z), min_no_nan(corner[2].z, corner[3].z));
  Float8 inverse_depth[4];
  for (int i = 0; i < 4; ++i) {
    inverse_depth[i] = reciprocal_in_range(corner[i].z);
    strips.corner[i] = {camera.center_x_px + camera.focal_x_px * (corner[i].x * inverse_depth[i]),
                        camera.center_y_px + camera.focal_y_px * (corner[i].y * inverse_depth[i])};
  }
  if (setting.line_floor_px > 0.0f) {
    const WideningX8 widening(camera, setting.line_floor_px, corner[0] + corner[1], corner[3] + corner[2]);
    Vec2x8* const on_screen = strips.corner;
    const Vec2x8 push_a = widening.push_px(on_screen[0] - on_screen[1]);
    const Vec2x8 push_b = widening.push_px(on_screen[3] - on_screen[2]);
    on_screen[0] = on_screen[0] + push_a;
    on_screen[1] = on_screen[1] - push_a;
    on_screen[2] = on_screen[2] - push_b;
    on_screen[3] = on_screen[3] + push_b;
  }
  const ScreenBounds none;
  strips.low = {none.low.x, none.low.y};
  strips.high = {none.high.x, none.high.y};
  strips.inverse_depth_low = none.inverse_depth_low;
  strips.inverse_depth_high = none.inverse_depth_high;
  for (int i = 0; i < 4; ++i) {
    strips.low = {min_no_nan(strips.low.x, strips.corner[i].x), min_no_nan(strips.low.y, strips.corner[i].y)};
    strips.high = {max_no_nan(strips.high.x, strips.corner[i].x), max_no_nan(strips.high.y, strips.corner[i].y)};
    strips.inverse_depth_low = min_no_nan(strips.inverse_depth_low, inverse_depth[i]);
    strips.inverse_depth_high = max_no_nan(strips.inverse_depth_high, inverse_depth[i]);
  }
  const Float8 width_px = static_cast<float>(camera.width_px), height_px = static_cast<float>(camera.height_px);
  const Mask8 is_in_guard_band = (strips.low.x >= -kGuardBand_px) & (strips.low.y >= -kGuardBand_px) &
                                 (strips.high.x <= width_px + kGuardBand_px) &
                                 (strips.high.y <= height_px + kGuardBand_px);
  const Mask8 meets_image =
      (strips.high.x >= 0.0f) & (strips.high.y >= 0.0f) & (strips.low.x < width_px) & (strips.low.y < height_px);
  const Mask8 is_near = nearest_m < kNear_m;
  strips.crossing = bits_of(is_bright & (is_near | (meets_image & ~is_in_guard_band)));
  const Mask8 is_inside = is_bright & ~is_near & meets_image & is_in_guard_band;
  if (bits_of(is_inside) == 0) return strips;

  // is_quad_visible() and min_area_of()
  const Float8 twice_area = cross(strips.corner[2] - strips.corner[0], strips.corner[3] - strips.corner[1]);
  const Float8 brightest = max_no_nan(strips.color.x, max_no_nan(strips.color.y, strips.color.z));
  const Float8 min_area = kMinWeight * reciprocal_in_range(max_no_nan(brightest, kMinWeight / kMaxSparedArea));
  strips.clockwise = bits_of(twice_area > 0.0f);
  const Mask8 is_large = is_inside & (magnitude(twice_area) >= 2.0f * min_area);
  const Float8 standing = nearest_standing(strips.normal, strips.offset);
  strips.visible =
      bits_of(is_large & ~occludes(setting.occluders, camera, strips, strips.inverse_depth_high * standing));
  return strips;
}

}  // namespace pictura
