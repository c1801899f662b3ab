// Which of two things is in front. Of two convex things that do not intersect, one is on the camera's side of a plane
// that separates them, and so is nearer wherever both are seen: the middle of what their faces share on screen decides.
// Shared by both devices.
#pragma once

#include "pictura/common/raster_coverage.h"
#include "pictura/common/raster_shapes.h"

namespace pictura {

/// What a thing covers of the ground, relative to the camera: corners with the heights of its lower end.
struct Extent {
  Vec2 corner[4];
  float low_m[4] = {};
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
  return extent;
}

PICTURA_HD inline Extent wall_extent(const WallFace& wall, Vec3 eye_m) {
  Extent extent;
  extent.corners = 2;
  extent.corner[0] = wall.a_m.xy() - eye_m.xy();
  extent.corner[1] = wall.b_m.xy() - eye_m.xy();
  extent.low_m[0] = wall.a_m.z - eye_m.z;
  extent.low_m[1] = wall.b_m.z - eye_m.z;
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
  float low = 1e30f, high = -1e30f;
};

/// Heights of an extent's lower end above the camera.
PICTURA_HD inline Interval heights_of(const Extent& e) {
  Interval heights;
  for (int i = 0; i < e.corners; ++i) {
    heights.low = min_of(heights.low, e.low_m[i]);
    heights.high = max_of(heights.high, e.low_m[i]);
  }
  return heights;
}

/// Whether two extents overlap on the ground plane: no side of either separates them. Touching is no overlap.
PICTURA_HD inline bool overlap_on_ground(const Extent& a, const Extent& b) {
  constexpr float kTouching_m = 1e-3f;
  auto project = [](const Extent& e, Vec2 axis) {
    Interval interval;
    for (int i = 0; i < e.corners; ++i) {
      interval.low = min_of(interval.low, dot(axis, e.corner[i]));
      interval.high = max_of(interval.high, dot(axis, e.corner[i]));
    }
    return interval;
  };
  auto separated_by_side_of = [&](const Extent& e) {
    for (int i = 0; i < e.corners; ++i) {
      const Vec2 side = e.corner[i + 1 < e.corners ? i + 1 : 0] - e.corner[i];
      const float norm = length(side);
      if (norm < 1e-6f) continue;
      const Vec2 axis = left_normal(side) * (1.0f / norm);
      const Interval of_a = project(a, axis), of_b = project(b, axis);
      if (min_of(of_a.high, of_b.high) - max_of(of_a.low, of_b.low) <= kTouching_m) return true;
    }
    return false;
  };
  return !separated_by_side_of(a) && !separated_by_side_of(b);
}

/// Whether a solid stands on a strip, which then lies behind it (see kStanding_m).
PICTURA_HD inline bool stands_on(const Extent& solid, const Extent& strip) {
  auto corner = [](const Extent& e, int i) { return Vec3{e.corner[i].x, e.corner[i].y, e.low_m[i]}; };
  Vec3 middle{};
  for (int i = 0; i < solid.corners; ++i) middle = middle + corner(solid, i);
  middle = middle * (1.0f / static_cast<float>(solid.corners));
  const Vec3 normal = cross(corner(strip, 2) - corner(strip, 0), corner(strip, 3) - corner(strip, 1));
  const float above_m = dot(normal, middle - corner(strip, 0));
  return fabsf(above_m) <= kStanding_m * fabsf(normal.z) && overlap_on_ground(solid, strip);
}

/// What two faces share on screen.
struct SharedRegion {
  float area_px2 = 0;
  Vec2 middle_px;  // mean of its corners
};

/// Whether some edge of a face has all of another on its outer side.
PICTURA_HD inline bool is_outside(const PolygonEdge* edges, int count, const PolygonEdge* borders, int num_borders) {
  for (int j = 0; j < num_borders; ++j) {
    bool outside = true;
    for (int i = 0; i < count && outside; ++i) outside = inner_distance(borders[j], edge_from(edges[i])) <= 0.0f;
    if (outside) return true;
  }
  return false;
}

/// The border of the intersection of two convex faces consists of the parts of each one's edges that lie within the
/// other: their ends give its middle, and Green's theorem its area. Where edges coincide they count twice.
PICTURA_HD inline SharedRegion shared_region(const ScreenFace& a, const ScreenFace& b, const PolygonEdge* edges) {
  const PolygonEdge *of_a = edges + a.edge_begin, *of_b = edges + b.edge_begin;
  SharedRegion region;
  if (is_outside(of_a, a.edge_count, of_b, b.edge_count) || is_outside(of_b, b.edge_count, of_a, a.edge_count)) {
    return region;
  }
  const Vec2 origin = edge_from(of_a[0]);  // near by, for precision
  Vec2 sum{};
  float twice_area = 0.0f;
  int corners = 0;
  auto add_parts = [&](const PolygonEdge* parts, int num_parts, const PolygonEdge* borders, int num_borders) {
    for (int i = 0; i < num_parts; ++i) {
      const Vec2 from = edge_from(parts[i]), to = edge_to(parts[i]);
      float begin = 0.0f, end = 1.0f;
      for (int j = 0; j < num_borders && begin < end; ++j) {
        const float at_from = inner_distance(borders[j], from), at_to = inner_distance(borders[j], to);
        if (at_from < 0.0f && at_to < 0.0f) end = 0.0f;
        if (at_from < 0.0f)
          begin = max_of(begin, at_from / (at_from - at_to));
        else if (at_to < 0.0f)
          end = min_of(end, at_from / (at_from - at_to));
      }
      if (begin >= end) continue;
      const Vec2 p = from + (to - from) * begin - origin, q = from + (to - from) * end - origin;
      sum = sum + p + q;
      twice_area += cross(p, q);
      corners += 2;
    }
  };
  add_parts(of_a, a.edge_count, of_b, b.edge_count);
  add_parts(of_b, b.edge_count, of_a, a.edge_count);
  if (corners == 0) return region;
  region.area_px2 = 0.5f * twice_area;
  region.middle_px = origin + sum * (1.0f / static_cast<float>(corners));
  return region;
}

/// Whether two strips are of one level where a ray meets them: the nearer point is close to the other's plane. Takes
/// the inverse depths along the ray and the camera's distances from the planes.
PICTURA_HD inline bool of_one_level(float inverse_a, float distance_a_m, float inverse_b, float distance_b_m) {
  const float nearer = max_of(inverse_a, inverse_b);
  const float gap_m = fabsf(inverse_a - inverse_b) * (inverse_a < inverse_b ? distance_a_m : distance_b_m);
  return gap_m < kSameLevel_m * nearer;
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
