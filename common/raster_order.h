// Which of two things is in front: the one on the camera's side of a plane that separates them. Solids are upright
// prisms, so planes through their sides and level planes decide; strips add the plane that they lie in. Everything is
// relative to the camera, which is the origin. Shared by both devices.
#pragma once

#include "pictura/common/raster_shapes.h"

namespace pictura {

/// What a thing occupies: corners in the ground plane, each with the heights of its lower end; prisms reach up by
/// height_m from there, strips have no height.
struct Extent {
  Vec2 corner[4];
  float low_m[4] = {};
  float height_m = 0;
  int32_t corners = 0;
  bool is_strip = false;
  uint32_t rank = 0;  // of strips: the lower is painted over the higher where they overlap on one level
};

PICTURA_HD inline Extent agent_extent(const AgentBox& box, Vec3 eye_m) {
  const Vec2 ahead{box.cos_heading, box.sin_heading};
  const Vec2 along = ahead * (0.5f * box.length_m), across = left_normal(ahead) * (0.5f * box.width_m);
  const Vec3 center = box.center_m - eye_m;
  Extent extent;
  extent.corners = 4;
  extent.corner[0] = center.xy() + along + across;
  extent.corner[1] = center.xy() - along + across;
  extent.corner[2] = center.xy() - along - across;
  extent.corner[3] = center.xy() + along - across;
  for (float& low : extent.low_m) low = center.z;
  extent.height_m = box.height_m;
  return extent;
}

PICTURA_HD inline Extent wall_extent(const WallFace& wall, Vec3 eye_m) {
  Extent extent;
  extent.corners = 2;
  extent.corner[0] = wall.a_m.xy() - eye_m.xy();
  extent.corner[1] = wall.b_m.xy() - eye_m.xy();
  extent.low_m[0] = wall.a_m.z - eye_m.z;
  extent.low_m[1] = wall.b_m.z - eye_m.z;
  extent.height_m = wall.height_m;
  return extent;
}

PICTURA_HD inline Extent light_extent(const LightHead& head, Vec3 eye_m) {
  const Vec2 left = left_normal(head.facing) * kLightRadius_m;
  const Vec3 center = head.position_m - eye_m;
  Extent extent;
  extent.corners = 2;
  extent.corner[0] = center.xy() + left;
  extent.corner[1] = center.xy() - left;
  extent.low_m[0] = extent.low_m[1] = center.z - kLightRadius_m;
  extent.height_m = 2.0f * kLightRadius_m;
  return extent;
}

/// Ranks strips by kind, then by index.
PICTURA_HD inline uint32_t rank_of(const Strip& strip, uint32_t index) {
  return (static_cast<uint32_t>(strip_rank(strip.kind)) << 28) | index;
}

PICTURA_HD inline Extent strip_extent(const Strip& strip, uint32_t index, Vec3 eye_m) {
  Vec3 corners[4];
  strip_corners(strip, corners);
  Extent extent;
  extent.corners = 4;
  extent.is_strip = true;
  extent.rank = rank_of(strip, index);
  for (int i = 0; i < 4; ++i) {
    extent.corner[i] = corners[i].xy() - eye_m.xy();
    extent.low_m[i] = corners[i].z - eye_m.z;
  }
  return extent;
}

/// Square of the distance on the ground from the camera to the nearest point of an extent; 0 above or inside it.
PICTURA_HD inline float nearest_distance2(const Extent& e) {
  float nearest = 1e30f;
  int left_of = 0, right_of = 0;
  for (int i = 0; i < e.corners; ++i) {
    const Vec2 a = e.corner[i], b = e.corner[i + 1 < e.corners ? i + 1 : 0], ab = b - a;
    const float length2 = dot(ab, ab);
    const float t = length2 > 0.0f ? clamp(-dot(a, ab) / length2, 0.0f, 1.0f) : 0.0f;
    const Vec2 p = a + ab * t;
    nearest = min_of(nearest, dot(p, p));
    const float side = cross(a, b);
    left_of += side >= 0.0f;
    right_of += side <= 0.0f;
  }
  return e.corners > 2 && (left_of == e.corners || right_of == e.corners) ? 0.0f : nearest;
}

struct Interval {
  float low = 0, high = 0;
};

PICTURA_HD inline Interval project_on(const Extent& e, Vec3 axis) {
  Interval interval{1e30f, -1e30f};
  const float up = axis.z * e.height_m;
  for (int i = 0; i < e.corners; ++i) {
    const float at = axis.x * e.corner[i].x + axis.y * e.corner[i].y + axis.z * e.low_m[i];
    interval.low = min_of(interval.low, at + min_of(up, 0.0f));
    interval.high = max_of(interval.high, at + max_of(up, 0.0f));
  }
  return interval;
}

/// What is known of two things: whether some separating plane shows that nothing hides the one or the other.
struct Clearance {
  bool a_is_free = false, b_is_free = false;  // b cannot hide a; a cannot hide b
};

/// Adds what planes across `axis` say. Touching, and penetrating by at most tolerance_m, counts as apart.
PICTURA_HD inline void look_across(Vec3 axis, const Extent& a, const Extent& b, float tolerance_m, Clearance* clear) {
  const Interval ia = project_on(a, axis), ib = project_on(b, axis);
  auto apart = [&](Interval lower, Interval upper, bool* lower_is_free, bool* upper_is_free) {
    if (upper.low < lower.high - tolerance_m) return;
    const float middle = 0.5f * (lower.high + upper.low);
    // Any plane of the gap will do: the camera (0) is on the lower one's side of some if the gap's end is not below it.
    if (max_of(upper.low, middle) >= 0.0f) *lower_is_free = true;
    if (min_of(lower.high, middle) <= 0.0f) *upper_is_free = true;
  };
  apart(ia, ib, &clear->a_is_free, &clear->b_is_free);
  apart(ib, ia, &clear->b_is_free, &clear->a_is_free);
}

PICTURA_HD inline void look_across_sides(const Extent& sides_of, const Extent& a, const Extent& b, Clearance* clear) {
  constexpr float kTouching_m = 1e-3f;
  auto look = [&](Vec2 normal) {
    const float norm = length(normal);
    if (norm < 1e-6f) return;
    look_across({normal.x / norm, normal.y / norm, 0.0f}, a, b, kTouching_m, clear);
  };
  if (sides_of.corners == 2) {
    const Vec2 along = sides_of.corner[1] - sides_of.corner[0];
    look(left_normal(along));
    look(along);
    return;
  }
  // Boxes have two pairs of parallel sides; a strip's long sides are parallel and its mitred ends are not.
  const int sides = sides_of.is_strip ? 3 : 2;
  for (int i = 0; i < sides; ++i) look(left_normal(sides_of.corner[i + 1] - sides_of.corner[i]));
}

/// Normal of the plane that a strip lies in, upwards.
PICTURA_HD inline Vec3 strip_normal(const Extent& strip) {
  const Vec3 p0{strip.corner[0].x, strip.corner[0].y, strip.low_m[0]},
      p1{strip.corner[1].x, strip.corner[1].y, strip.low_m[1]},
      p2{strip.corner[2].x, strip.corner[2].y, strip.low_m[2]},
      p3{strip.corner[3].x, strip.corner[3].y, strip.low_m[3]};
  const Vec3 normal = cross(p2 - p0, p3 - p1);
  const float norm = length(normal);
  if (norm < 1e-9f) return {0.0f, 0.0f, 1.0f};
  return normal * ((normal.z < 0.0f ? -1.0f : 1.0f) / norm);
}

/// How far a solid's foot may dip below a strip that it stands on: upright boxes on slopes do.
constexpr float kStanding_m = 0.5f;
/// Strips whose planes are closer than this are one level, where rank decides.
constexpr float kSameLevel_m = 0.05f;

/// Which of two things must be drawn first, being in front: -1 a, 1 b, 0 neither hides the other. Where they intersect,
/// a is (callers pass things in order of distance, then number), but for strips, which lie behind what stands on them.
PICTURA_HD inline int order_of(const Extent& a, const Extent& b) {
  Clearance clear;
  look_across_sides(a, a, b, &clear);
  look_across_sides(b, a, b, &clear);
  if (clear.a_is_free && clear.b_is_free) return 0;
  if (a.is_strip && b.is_strip) {
    const Vec3 normal = strip_normal(a);
    const Interval ia = project_on(a, normal), ib = project_on(b, normal);
    const bool same_level = ib.low < ia.high + kSameLevel_m && ia.low < ib.high + kSameLevel_m;
    if (same_level && !clear.a_is_free && !clear.b_is_free) return a.rank < b.rank ? -1 : 1;
    if (!same_level) {
      look_across({0.0f, 0.0f, 1.0f}, a, b, 0.0f, &clear);
      look_across(normal, a, b, 0.0f, &clear);
      look_across(strip_normal(b), a, b, 0.0f, &clear);
    }
  } else if (a.is_strip || b.is_strip) {
    const Extent& strip = a.is_strip ? a : b;
    const Extent& solid = a.is_strip ? b : a;
    const Vec3 normal = strip_normal(strip);
    const Interval plane = project_on(strip, normal), body = project_on(solid, normal);
    const bool camera_above = 0.5f * (plane.low + plane.high) <= 0.0f;
    if (body.low >= plane.low - kStanding_m) {
      bool& upper_is_free = a.is_strip ? clear.b_is_free : clear.a_is_free;
      bool& lower_is_free = a.is_strip ? clear.a_is_free : clear.b_is_free;
      (camera_above ? upper_is_free : lower_is_free) = true;
    } else {
      look_across(normal, a, b, 0.0f, &clear);
      look_across({0.0f, 0.0f, 1.0f}, a, b, 0.0f, &clear);
    }
    if (!clear.a_is_free && !clear.b_is_free) return (camera_above == a.is_strip) ? 1 : -1;
  } else {
    look_across({0.0f, 0.0f, 1.0f}, a, b, 0.0f, &clear);
  }
  if (clear.a_is_free && clear.b_is_free) return 0;
  return clear.b_is_free ? 1 : -1;
}

/// A level strip below every foot and below the camera lies behind all solids and needs no pairwise test.
PICTURA_HD inline bool lies_behind_all(float strip_high_m, float lowest_foot_m) {
  return strip_high_m < 0.0f && strip_high_m <= lowest_foot_m + 0.3f;
}

/// Key of the order in which the pairwise test takes things: nearest first, then by number.
struct OrderKey {
  float distance2 = 0;
  uint32_t number = 0;
};
PICTURA_HD constexpr bool operator<(const OrderKey& a, const OrderKey& b) {
  return a.distance2 < b.distance2 || (a.distance2 == b.distance2 && a.number < b.number);
}

}  // namespace pictura
