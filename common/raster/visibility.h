// Visibility within a pixel, for host and CUDA code. A fragment is the part of a pixel that one face covers. For each
// pair of fragments, samples_in_front() and occluded_samples() decide which samples of each are hidden by the other.
// The nearer plane at the centroid of the shared samples is in front, so primitives need no order.
#pragma once

#include "pictura/common/portable/intrinsics.h"
#include "pictura/common/raster/coverage.h"
#include "pictura/common/raster/shapes.h"

namespace pictura {

// Object ids are unique within an image. From the highest bits, they contain the kind, the rank (strips only) and the
// index.
constexpr int kKindShift = 30, kRankShift = 28;
constexpr uint32_t kAgentKind = 0, kWallKind = 1, kLightKind = 2, kStripKind = 3;
constexpr uint32_t kIndexMask = (1u << kRankShift) - 1;

PICTURA_HD constexpr uint32_t make_object_id(uint32_t kind, int32_t index) {
  return (kind << kKindShift) | static_cast<uint32_t>(index);
}
/// `index` is the strip's index in the geometry.
PICTURA_HD inline uint32_t strip_object_id(const Strip& strip, int32_t index) {
  return (kStripKind << kKindShift) | (static_cast<uint32_t>(strip_rank(strip.kind)) << kRankShift) |
         static_cast<uint32_t>(index);
}
/// Entry of a list of visible faces: the object id and, in higher bits, the number of an agent's face.
constexpr int kFaceShift = 27;
constexpr uint32_t kFaceIndexMask = (1u << kFaceShift) - 1;
PICTURA_HD constexpr uint32_t face_entry(uint32_t object_id, int face) {
  return object_id | static_cast<uint32_t>(face) << kFaceShift;
}
PICTURA_HD constexpr uint32_t kind_of(uint32_t object_id) { return object_id >> kKindShift; }
PICTURA_HD constexpr int32_t index_of(uint32_t object_id) { return static_cast<int32_t>(object_id & kIndexMask); }
PICTURA_HD constexpr bool is_strip(const ScreenFace& face) { return kind_of(face.object_id) == kStripKind; }

/// Outline of a primitive on the ground plane, at the height of its lower end. If the outline is a line, each end
/// occurs twice.
struct Extent {
  Vec3 corner[4];
};
PICTURA_HD inline Extent extent_between(Vec3 a, Vec3 b) { return {{a, b, b, a}}; }

PICTURA_HD inline Extent extent_of(const AgentBox& box) {
  Extent extent;
  cuboid_face_corners(box, kUnderside, extent.corner);
  return extent;
}
PICTURA_HD inline Extent extent_of(const WallFace& wall) { return extent_between(wall.a_m, wall.b_m); }
PICTURA_HD inline Extent extent_of(const LightHead& head) {
  const Vec2 left = left_normal(head.facing) * kLightRadius_m;
  const Vec3 lowest = head.position_m - Vec3{0.0f, 0.0f, kLightRadius_m};
  return extent_between(lowest + Vec3{left.x, left.y, 0.0f}, lowest - Vec3{left.x, left.y, 0.0f});
}
PICTURA_HD inline Extent extent_of(const Strip& strip) {
  Extent extent;
  strip_corners(strip, extent.corner);
  return extent;
}

/// `agents` points to the first agent of the world.
PICTURA_HD inline Extent extent_of(uint32_t object_id, const StaticGeometryView& pieces, const AgentBox* agents) {
  const int32_t index = index_of(object_id);
  switch (kind_of(object_id)) {
    case kAgentKind: return extent_of(agents[index]);
    case kWallKind: return extent_of(pieces.walls[index]);
    case kLightKind: return extent_of(pieces.heads[index]);
    default: return extent_of(pieces.strips[index]);
  }
}

/// Corners on the ground plane. turn() is used instead of a variable index, which would force the corners into a CUDA
/// thread's local memory.
struct GroundQuad {
  Vec2 corner[4];
  PICTURA_HD void turn() {
    const Vec2 first = corner[0];
    for (int i = 0; i < 3; ++i) corner[i] = corner[i + 1];
    corner[3] = first;
  }
};
PICTURA_HD inline GroundQuad ground_quad(const Extent& extent, Vec2 origin) {
  GroundQuad quad;
  for (int i = 0; i < 4; ++i) quad.corner[i] = extent.corner[i].xy() - origin;
  return quad;
}

/// Whether the first side of a separates a from b. Touching quads are separated.
PICTURA_HD inline bool first_side_separates(const GroundQuad& a, const GroundQuad& b) {
  constexpr float kTouching_m = 1e-3f;
  struct Interval {
    float low = 1e30f, high = -1e30f;
  };
  const Vec2 side = a.corner[1] - a.corner[0], axis = left_normal(side);
  auto project = [axis](const GroundQuad& quad) {
    Interval interval;
    for (const Vec2 corner : quad.corner) {
      const float at = dot(axis, corner);
      interval.low = min_no_nan(interval.low, at);
      interval.high = max_no_nan(interval.high, at);
    }
    return interval;
  };
  const Interval of_a = project(a), of_b = project(b);
  // Smallest displacement after which the quads would only touch, times the side's length. It is positive even if one
  // interval is a point within the other, for example the interval of a wall.
  const float overlap = min_no_nan(of_a.high - of_b.low, of_b.high - of_a.low);
  const float length2_m2 = dot(side, side);
  return length2_m2 > 1e-12f && (overlap <= 0.0f || overlap * overlap <= kTouching_m * kTouching_m * length2_m2);
}

/// Whether two extents overlap on the ground plane.
PICTURA_HD inline bool overlap_on_ground(const Extent& a, const Extent& b) {
  // Relative to a nearby point, for precision.
  const Vec2 origin = a.corner[0].xy();
  GroundQuad one = ground_quad(a, origin), other = ground_quad(b, origin);
  PICTURA_NO_UNROLL
  for (int side = 0; side < 8; ++side) {
    if (first_side_separates(one, other)) return false;
    one.turn();
    if (side != 3) continue;
    const GroundQuad first = one;
    one = other;
    other = first;
  }
  return true;
}

/// Whether a solid stands on a strip (see kStanding_m). The solid is in front of the strip for a camera above, and
/// behind it for a camera below.
PICTURA_HD inline bool stands_on(const Extent& solid, const Extent& strip) {
  Vec3 sum{};
  for (const Vec3 corner : solid.corner) sum = sum + (corner - strip.corner[0]);
  const Vec3 middle = sum * 0.25f;
  const Vec3 normal = cross(strip.corner[2] - strip.corner[0], strip.corner[3] - strip.corner[1]);
  return fabsf(dot(normal, middle)) <= kStanding_m * fabsf(normal.z) && overlap_on_ground(solid, strip);
}

/// Whether a face is a strip seen from below. Such a strip is in front of all solids that stand on it, although they
/// extend below it.
PICTURA_HD inline bool is_strip_from_below(const ScreenFace& face) { return face.plane_distance_m > 0.0f; }

/// Maximum ratio of the inverse depths of a solid and the strip on which it stands, along one ray from the camera.
/// Solids extend up to kThroughStrip_m below the strip. The ratio is infinite for a camera within this distance below
/// the strip, and 1 for a camera above.
PICTURA_HD inline float nearest_standing(float plane_distance_m) {
  if (!(plane_distance_m > 0.0f)) return 1.0f;
  return plane_distance_m > kThroughStrip_m ? plane_distance_m * reciprocal_in_range(plane_distance_m - kThroughStrip_m)
                                            : float_from_bits(0x7F800000u);
}

/// 1 / depth of a face, clamped to the range of its corners, which is wider for strips. Faces are compared by this
/// value.
PICTURA_HD inline float clamped_inverse_depth(const ScreenFace& face, Vec2 at_px) {
  return clamp(inverse_depth(face, at_px), face.inverse_depth_low, face.inverse_depth_high);
}

/// Depth of a face, clamped to the range of its corners.
PICTURA_HD inline float face_depth_m(const ScreenFace& face, Vec2 at_px) {
  const float widened = is_strip(face) ? kWidenedDepth : 1.0f;
  return 1.0f / clamp(inverse_depth(face, at_px), face.inverse_depth_low * widened, face.inverse_depth_high / widened);
}

/// Whether two strips are on one level (see kSameLevel_m) at the depth of the nearer strip. The depth is clamped,
/// because a widened strip may extend beyond the horizon of its plane.
PICTURA_HD inline bool of_one_level(const ScreenFace& a, const ScreenFace& b, Vec2 at_px) {
  const float nearest = max_of(clamped_inverse_depth(a, at_px), clamped_inverse_depth(b, at_px));
  // Heights of the point at this depth above the two planes, times `nearest`.
  const float above_a = (inverse_depth(a, at_px) - nearest) * a.plane_distance_m,
              above_b = (inverse_depth(b, at_px) - nearest) * b.plane_distance_m;
  return fabsf(above_a - above_b) < kSameLevel_m * nearest;
}

/// See kEqualDepth.
PICTURA_HD inline bool are_equal_depths(float inverse_depth_a, float inverse_depth_b) {
  return fabsf(inverse_depth_a - inverse_depth_b) < kEqualDepth * max_of(inverse_depth_a, inverse_depth_b);
}

/// Whether face a is in front of face b at a screen point: the nearer face, or at equal depths the lower object id.
/// `stands(solid, strip)` takes object ids, see stands_on().
template <typename Stands>
PICTURA_HD inline bool is_in_front(const ScreenFace& a, const ScreenFace& b, Vec2 at_px, Stands&& stands) {
  const bool strip_a = is_strip(a), strip_b = is_strip(b);
  if (strip_a && strip_b && of_one_level(a, b, at_px)) return a.object_id < b.object_id;
  const float inverse_depth_a = clamped_inverse_depth(a, at_px), inverse_depth_b = clamped_inverse_depth(b, at_px);
  const bool first = are_equal_depths(inverse_depth_a, inverse_depth_b) ? a.object_id < b.object_id
                                                                        : inverse_depth_a > inverse_depth_b;
  if (strip_a == strip_b) return first;
  // The depths may put the solid below the strip. A solid that stands on the strip merely cuts into the road, so the
  // order is reversed.
  const bool is_strip_first = first == strip_a, is_from_below = is_strip_from_below(strip_a ? a : b);
  if (is_strip_first == is_from_below) return first;
  return stands(strip_a ? b.object_id : a.object_id, strip_a ? a.object_id : b.object_id) ? !first : first;
}

/// Sums over samples: columns, rows, and sample_column_offset() in eighths of a row.
struct SampleSums {
  int32_t columns, rows, offsets;
};
PICTURA_HD inline SampleSums sums_of(uint64_t samples) {
  // Computed from the bits of column and row numbers.
  const int column_0 = popcount(samples & 0xFF00FF00FF00FF00ull), column_1 = popcount(samples & 0xFFFF0000FFFF0000ull),
            column_2 = popcount(samples & 0xFFFFFFFF00000000ull);
  const int rows = popcount(samples & 0xAAAAAAAAAAAAAAAAull) + 2 * popcount(samples & 0xCCCCCCCCCCCCCCCCull) +
                   4 * popcount(samples & 0xF0F0F0F0F0F0F0F0ull);
  return {column_0 + 2 * column_1 + 4 * column_2, rows, 4 * column_0 + 2 * column_1 + column_2};
}

/// Centroid of samples, relative to the pixel's corner. Without samples, the pixel's centre.
PICTURA_HD inline Vec2 centroid_of(uint64_t samples) {
  const int count = popcount(samples);
  if (count == 0) return {0.5f, 0.5f};
  const SampleSums sums = sums_of(samples);
  const float n = static_cast<float>(count);
  return {(static_cast<float>(sums.columns) + 0.5f * n) / (8.0f * n),
          (static_cast<float>(sums.rows) + (static_cast<float>(sums.offsets) + 0.5f * n) / 8.0f) / (8.0f * n)};
}

struct Fragment {
  PixelCoverage coverage;
  float inverse_depth = 0;  // at the centroid of the samples
  int32_t face = 0;
};

PICTURA_HD inline Fragment make_fragment(const ScreenFace& face, int32_t face_index, const PixelCoverage& coverage,
                                         int x, int y) {
  const Vec2 middle = Vec2{static_cast<float>(x), static_cast<float>(y)} + centroid_of(coverage.samples);
  return {coverage, clamped_inverse_depth(face, middle), face_index};
}

PICTURA_HD inline Vec2 pixel_center(int x, int y) {
  return {static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f};
}

/// Inverse depth of a face at a pixel's centre.
PICTURA_HD inline float center_inverse_depth(const ScreenFace& face, int x, int y) {
  return clamped_inverse_depth(face, pixel_center(x, y));
}
/// Maximum change of the inverse depth from the centre within a pixel.
PICTURA_HD inline float inverse_depth_half_range(const ScreenFace& face) {
  return 0.5f * (fabsf(face.inverse_depth_x) + fabsf(face.inverse_depth_y));
}

/// Number of used bits of occluder_bound(), from the highest.
constexpr int kOccluderBoundBits = 21;
/// Lower bound of the inverse depth of a face that covers a pixel fully. The face hides all faces whose inverse depth
/// is below the bound in the whole pixel. The bound of a strip is 0, because farther faces may be in front of it. The
/// bound is never negative, because kernels sort by its bits. It is reduced by more than kEqualDepth, so that equally
/// near faces stay.
PICTURA_HD inline float occluder_bound(const ScreenFace& face, int x, int y) {
  if (is_strip(face)) return 0.0f;
  const float lowest =
      max_of(face.inverse_depth_low, center_inverse_depth(face, x, y) - inverse_depth_half_range(face));
  constexpr float kLower = 1.0f - 2.0f * kEqualDepth;
  return float_from_bits(bits_from_float(lowest * kLower) & ~((1u << (32 - kOccluderBoundBits)) - 1));
}

/// Whether any part of a face may be in front of the largest occluder bound of pixel (x, y). A strip seen from below
/// also passes if a solid that stands on it may be in front of the bound. CUDA code may first test smaller bounds, in
/// any order.
PICTURA_HD inline bool passes_occluder_bound(const ScreenFace& face, float bound, int x, int y) {
  const float nearest = center_inverse_depth(face, x, y) + inverse_depth_half_range(face);
  return !(nearest * face.nearest_standing < bound);
}

/// Order of fragments: nearer first, then by object id.
PICTURA_HD inline bool is_nearer(const Fragment& a, const Fragment& b, const ScreenFace* faces) {
  if (a.inverse_depth != b.inverse_depth) return a.inverse_depth > b.inverse_depth;
  const uint32_t object_id_a = faces[a.face].object_id, object_id_b = faces[b.face].object_id;
  return object_id_a != object_id_b ? object_id_a < object_id_b : a.face < b.face;
}

/// Samples that two fragments share. A sliver, which has no samples, shares all samples of the other. If the result is
/// 0, neither occludes the other.
PICTURA_HD inline uint64_t shared_samples(const PixelCoverage& a, const PixelCoverage& b) {
  return a.samples != 0 && b.samples != 0 ? a.samples & b.samples : a.samples | b.samples;
}

/// Samples at which a linear function of the screen is positive. Its value at `middle` is given, and its gradient is
/// not 0.
PICTURA_HD inline uint64_t samples_where_positive(float value, Vec2 gradient, Vec2 middle) {
  const float scale = 1.0f / length(gradient);
  const Vec2 up = gradient * scale;
  const Vec2 zero = middle - up * (value * scale);
  const PolygonEdge edge = make_edge(zero, zero + Vec2{up.y, -up.x});
  return samples_inside(edge, -edge.x0, -edge.y0);
}

/// Returns the shared samples at which face `a` is in front of `b`. The faces belong to different primitives. Usually,
/// the centroid decides for all samples. If two solids intersect near the centroid and all_or_none is false, each
/// sample is decided separately, by the rule of is_in_front().
template <typename Stands>
PICTURA_HD inline uint64_t samples_in_front(const ScreenFace& a, const ScreenFace& b, uint64_t shared, Vec2 corner,
                                            bool all_or_none, Stands&& stands) {
  const Vec2 middle = centroid_of(shared), at = corner + middle;
  // The lower object id is the first operand, so that swapping a and b gives the same arithmetic.
  const bool swapped = b.object_id < a.object_id;
  const float inverse_depth_a = inverse_depth(a, at), inverse_depth_b = inverse_depth(b, at);
  const float sign = swapped ? -1.0f : 1.0f;
  const float lead =
      sign * (inverse_depth_a - inverse_depth_b) + kEqualDepth * max_of(inverse_depth_a, inverse_depth_b);
  const Vec2 gradient{sign * (a.inverse_depth_x - b.inverse_depth_x), sign * (a.inverse_depth_y - b.inverse_depth_y)};
  // All samples are within a pixel of the centroid along each axis.
  const bool change_places = fabsf(lead) < fabsf(gradient.x) + fabsf(gradient.y) && !is_strip(a) && !is_strip(b);
  if (!change_places || all_or_none) return is_in_front(a, b, at, stands) ? shared : 0;
  const uint64_t low_first = samples_where_positive(lead, gradient, middle);
  return shared & (swapped ? ~low_first : low_first);
}

/// Whether two fragments are of neighbouring surfaces: one is a sliver, and both together fill the pixel exactly. With
/// a larger tolerance, slivers of hidden surfaces would be included.
PICTURA_HD inline bool are_complementary(const PixelCoverage& a, const PixelCoverage& b) {
  constexpr float kExact = 1e-5f;
  return (a.samples == 0 || b.samples == 0) && max_of(a.area, b.area) < 1.0f && fabsf(a.area + b.area - 1.0f) < kExact;
}

/// Whether two fragments may still occlude more of each other. Visible samples only decrease, so false stays false.
PICTURA_HD inline bool may_occlude_more(uint64_t visible_a, uint64_t samples_a, uint64_t visible_b,
                                        uint64_t samples_b) {
  return ((visible_a & samples_b) | (visible_b & samples_a)) != 0;
}

struct OccludedSamples {
  uint64_t of_a = 0, of_b = 0;
};

/// For each of two fragments of different primitives, its samples that the other hides. a is in front at the shared
/// samples `a_first`. A sliver occludes nothing and is occluded as a whole. Only full fragments occlude full fragments.
PICTURA_HD inline OccludedSamples occluded_samples(const PixelCoverage& a, const PixelCoverage& b, uint64_t shared,
                                                   uint64_t a_first) {
  if (a.samples == 0 || b.samples == 0) {
    return {a.samples == 0 && a_first == 0 ? kAllSamples : 0, b.samples == 0 && a_first != 0 ? kAllSamples : 0};
  }
  return {a.is_full() && !b.is_full() ? 0 : shared & ~a_first, b.is_full() && !a.is_full() ? 0 : a_first};
}

/// Resolves the occlusion of two fragments. Faces of one primitive do not occlude each other.
template <typename Stands>
PICTURA_HD inline OccludedSamples occlude_pair(const PixelCoverage& a, const PixelCoverage& b, const ScreenFace& face_a,
                                               const ScreenFace& face_b, Vec2 corner, Stands&& stands) {
  const uint64_t shared = shared_samples(a, b);
  if (shared == 0 || face_a.object_id == face_b.object_id || are_complementary(a, b)) return {};
  const bool has_sliver = a.samples == 0 || b.samples == 0;
  return occluded_samples(a, b, shared, samples_in_front(face_a, face_b, shared, corner, has_sliver, stands));
}

}  // namespace pictura
