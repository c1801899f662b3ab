// Clipping of faces that cross the frustum, and set-up of lights. A lane clips a face of four corners. A warp handles
// lights, and faces with too many corners for a lane, with one lane per corner. Results are bitwise identical to
// clip_face and make_screen_face.
#pragma once

#include "pictura/backend_cuda/renderer/draw_memory.cuh"
#include "pictura/common/portable/async_copy.h"
#include "pictura/common/portable/intrinsics.h"
#include "pictura/common/raster/clip.h"

namespace pictura::cuda {

static_assert(kMaxPolygonCorners <= kWarpSize);

/// Maximum corners of a lane's face. A face cut by all five planes may have nine.
constexpr int kLaneCorners = 8;

struct ClipShared {
  Quad quad;  // quad of one lane, read by all lanes
  // Corners: a lane's face takes the lane's column; a warp's face takes the first row. Two more rows hold corners that
  // are written before the count is checked.
  static constexpr int kRows = kLaneCorners + 2;
  float x[kRows][kWarpSize], y[kRows][kWarpSize], z[kRows][kWarpSize];
  uint16_t edges[kLaneCorners * kWarpSize];  // see LaneEdge
};

/// An edge of a lane's face, packed into 16 bits.
struct LaneEdge {
  int lane, from, to;  // lane of the face, and rows of the edge's corners
  bool is_clockwise;
  __device__ uint16_t packed() const {
    return static_cast<uint16_t>(lane | from << 5 | to << 9 | (is_clockwise ? 1 << 13 : 0));
  }
  __device__ static LaneEdge unpacked(unsigned word) {
    return {static_cast<int>(word & 31), static_cast<int>(word >> 5 & 15), static_cast<int>(word >> 9 & 15),
            (word >> 13 & 1) != 0};
  }
};
static_assert(kWarpSize <= 32 && kLaneCorners <= 16);

class LaneCorners {
 public:
  __device__ explicit LaneCorners(ClipShared* storage) : storage_(storage) {}
  __device__ Vec3 operator[](int i) const {
    return {storage_->x[i][lane_index()], storage_->y[i][lane_index()], storage_->z[i][lane_index()]};
  }
  __device__ void set(int i, Vec3 p) const {
    storage_->x[i][lane_index()] = p.x;
    storage_->y[i][lane_index()] = p.y;
    storage_->z[i][lane_index()] = p.z;
  }

 private:
  ClipShared* storage_;
};

// Stores words of 16 bytes, so that a warp's stores touch fewer memory segments.
template <typename Value>
__device__ void store_words(Value* to, const Value& value) {
  static_assert(sizeof(Value) % sizeof(uint4) == 0 && alignof(Value) >= sizeof(uint4));
  constexpr int kWords = sizeof(Value) / sizeof(uint4);
  uint4 words[kWords];
  memcpy(words, &value, sizeof(Value));
  for (int i = 0; i < kWords; ++i) reinterpret_cast<uint4*>(to)[i] = words[i];
}

template <typename Value>
__device__ void copy_words(Value* to, const Value& from) {
  constexpr int kWords = sizeof(Value) / sizeof(uint4);
  static_assert(sizeof(Value) % sizeof(uint4) == 0 && alignof(Value) >= sizeof(uint4));
  for (int word = lane_index(); word < kWords; word += kWarpSize) {
    reinterpret_cast<uint4*>(to)[word] = reinterpret_cast<const uint4*>(&from)[word];
  }
}

// The copy is valid after all lanes have called wait_for_copies().
template <typename Value>
__device__ void copy_words_async(Value* to, const Value& from) {
  static_assert(sizeof(Value) % sizeof(uint64_t) == 0 && alignof(Value) >= sizeof(uint64_t));
  for (size_t at = sizeof(uint64_t) * static_cast<size_t>(lane_index()); at < sizeof(Value);
       at += sizeof(uint64_t) * kWarpSize) {
    copy_into_shared(reinterpret_cast<char*>(to) + at, reinterpret_cast<const char*>(&from) + at);
  }
}

/// A face with one corner per lane; the other members are equal in all lanes.
struct WarpFace {
  Vec3 corner;  // valid in lanes below count
  int count = 0;
  FacePlane plane;
  Rgb color;
  PrimitiveRef primitive;
};

__device__ inline Vec3 corner_of(Vec3 corner, int lane) {
  return {__shfl_sync(kAllLanes, corner.x, lane), __shfl_sync(kAllLanes, corner.y, lane),
          __shfl_sync(kAllLanes, corner.z, lane)};
}

// Sums the first kMaxPolygonCorners lanes in lane order.
__device__ inline float sum_in_order(float value) {
  float sum = 0.0f;
  for (int lane = 0; lane < kMaxPolygonCorners; ++lane) sum += __shfl_sync(kAllLanes, value, lane);
  return sum;
}

// Returns an integer that sorts like the float with these bits.
__device__ inline int32_t sortable_bits(int32_t bits) { return bits ^ (bits >> 31 & 0x7FFFFFFF); }
__device__ inline float warp_min(float value) {
  return __int_as_float(sortable_bits(__reduce_min_sync(kAllLanes, sortable_bits(__float_as_int(value)))));
}
__device__ inline float warp_max(float value) {
  return __int_as_float(sortable_bits(__reduce_max_sync(kAllLanes, sortable_bits(__float_as_int(value)))));
}

// Broadcasts the quad of lane `owner`, as a widened face.
__device__ inline WarpFace broadcast_quad(const PinholeCamera& camera, ClipShared* storage, int owner,
                                          const Quad& quad) {
  __syncwarp();
  if (lane_index() == owner) storage->quad = quad;
  __syncwarp();
  const CameraQuad& quad_of_owner = storage->quad.in_camera;
  WarpFace face{{}, 0, quad_of_owner.plane, quad_of_owner.color, storage->quad.primitive};
  face.count = widen_in_front(camera, storage->quad.floor_px, quad_of_owner.corner, [&face](int i, Vec3 p) {
    if (i == lane_index()) face.corner = p;
  });
  return face;
}

// A black light has no corners.
__device__ inline WarpFace make_light(const FaceSetupContext& context, int32_t index) {
  const LightHead head = context.heads[index];
  const PinholeCamera& camera = context.setting.camera;
  LightDisk disk;
  const bool is_visible = light_to_camera(head, context.lights[head.signal], camera, &disk);
  return {to_camera(camera, light_corner(head, lane_index())), is_visible ? kLightSides : 0, disk.plane, disk.color,
          light_ref(index)};
}

// Clips a lane's face in place; the result equals that of clip_face. Returns the number of corners, or kTooManyCorners
// if they do not fit or the face is not exactly convex.
constexpr int kTooManyCorners = -1;
__device__ inline int clip(const Frustum& f, unsigned crossed, int count, LaneCorners corners) {
  if (crossed == kOutside) return 0;
  PICTURA_NO_UNROLL
  for (; crossed != 0 && count > 0; crossed &= crossed - 1) {
    const ClipPlane plane(f, __ffs(static_cast<int>(crossed)) - 1);
    Vec3 previous = corners[count - 1], current = corners[0];
    float previous_inside = plane.inside(previous);
    int kept = 0;
    PICTURA_NO_UNROLL
    for (int i = 0; i < count; ++i) {
      const Vec3 next = corners[min_of(i + 1, count - 1)];
      const float inside = plane.inside(current);
      const bool is_cut = (previous_inside >= 0.0f) != (inside >= 0.0f), stays = inside >= 0.0f;
      if (is_cut) corners.set(kept, cut_between(previous, previous_inside, current, inside));
      kept += is_cut ? 1 : 0;
      if (stays) corners.set(kept, current);
      kept += stays ? 1 : 0;
      if (kept > min_of(i + 2, kLaneCorners)) return kTooManyCorners;
      previous = current;
      previous_inside = inside;
      current = next;
    }
    count = kept < 3 ? 0 : kept;
  }
  return count;
}

// Projects a lane's clipped face in place, with the result of make_screen_face. Returns a bit mask of the corners at
// which an edge begins; 0 if the face covers nothing.
__device__ inline unsigned project_in_place(const PinholeCamera& camera, LaneCorners corners, int count,
                                            ScreenBounds* bounds, bool* is_clockwise) {
  PICTURA_NO_UNROLL
  for (int i = 0; i < count; ++i) {
    const Vec3 p = corners[i];
    const float inverse_depth = reciprocal_in_range(p.z);
    const Vec2 corner = project(camera, p, inverse_depth);
    bounds->add(corner, inverse_depth);
    corners.set(i, {corner.x, corner.y, 0.0f});
  }
  if (!bounds->meet_image(camera)) return 0;
  const Vec2 first = corners[0].xy();
  Vec2 corner = first;
  float twice_area = 0.0f;
  unsigned edges = 0;
  PICTURA_NO_UNROLL
  for (int i = 0; i < count; ++i) {
    const Vec2 next = i + 1 < count ? corners[i + 1].xy() : first;
    if (i > 0 && i + 1 < count) twice_area += cross(corner - first, next - first);
    if (corner.x != next.x || corner.y != next.y) edges |= 1u << i;
    corner = next;
  }
  *is_clockwise = twice_area > 0.0f;
  return fabsf(twice_area) < kMinTwiceArea_px2 ? 0 : edges;
}

// Version of clip_face for a face with one corner per lane.
__device__ inline void clip(const Frustum& f, ClipShared* storage, WarpFace* face_inout) {
  const int lane = lane_index();
  Vec3 corner = face_inout->corner;
  int count = face_inout->count;
  const unsigned outside = lane < count ? planes_outside(f, corner) : 0;
  const bool is_outside = __reduce_or_sync(kAllLanes, lane < count ? ~outside : 0u) != ~0u;
  unsigned crossed = is_outside ? 0u : __reduce_or_sync(kAllLanes, outside);
  if (is_outside) count = 0;
  PICTURA_NO_UNROLL
  for (; crossed != 0 && count > 0; crossed &= crossed - 1) {
    const ClipPlane plane(f, __ffs(static_cast<int>(crossed)) - 1);
    const int before = lane > 0 ? lane - 1 : count - 1;
    const Vec3 previous = corner_of(corner, before);
    const float inside = plane.inside(corner), previous_inside = __shfl_sync(kAllLanes, inside, before);
    const bool stays = lane < count && inside >= 0.0f;
    const bool is_cut = lane < count && (previous_inside >= 0.0f) != (inside >= 0.0f);
    const unsigned cuts = __ballot_sync(kAllLanes, is_cut), staying = __ballot_sync(kAllLanes, stays);
    const int index = __popc(cuts & lanes_below()) + __popc(staying & lanes_below());
    // Only a face that is not exactly convex exceeds the maximum; excess corners are dropped.
    const bool fits = index + 2 <= kMaxPolygonCorners;
    auto keep = [&](int at, Vec3 p) {
      storage->x[0][at] = p.x;
      storage->y[0][at] = p.y;
      storage->z[0][at] = p.z;
    };
    if (is_cut && fits) keep(index, cut_between(previous, previous_inside, corner, inside));
    if (stays && fits) keep(index + (is_cut ? 1 : 0), corner);
    const unsigned fitting = __ballot_sync(kAllLanes, fits);
    count = __popc(cuts & fitting) + __popc(staying & fitting);
    if (count < 3) count = 0;
    __syncwarp();
    corner = {storage->x[0][lane], storage->y[0][lane], storage->z[0][lane]};
    __syncwarp();
  }
  face_inout->corner = corner;
  face_inout->count = count;
}

// Version of make_screen_face for a face with one corner per lane. Stores the edges from edge_begin on.
__device__ inline bool make_screen_face(const FaceSetupContext& context, const WarpFace& face, int32_t edge_begin,
                                        ScreenFace* face_out) {
  const PinholeCamera& camera = context.setting.camera;
  const int lane = lane_index(), count = face.count;
  const bool is_corner = lane < count;
  const float inverse_depth = is_corner ? reciprocal_in_range(face.corner.z) : 0.0f;
  const Vec2 corner = project(camera, face.corner, inverse_depth);
  ScreenBounds bounds;
  bounds.low = {warp_min(is_corner ? corner.x : 1e30f), warp_min(is_corner ? corner.y : 1e30f)};
  bounds.high = {warp_max(is_corner ? corner.x : -1e30f), warp_max(is_corner ? corner.y : -1e30f)};
  bounds.inverse_depth_low = warp_min(is_corner ? inverse_depth : 1e30f);
  bounds.inverse_depth_high = warp_max(inverse_depth);
  if (!bounds.meet_image(camera)) return false;
  const int next_lane = lane + 1 < count ? lane + 1 : 0;
  const Vec2 next{__shfl_sync(kAllLanes, corner.x, next_lane), __shfl_sync(kAllLanes, corner.y, next_lane)};
  const Vec2 first{__shfl_sync(kAllLanes, corner.x, 0), __shfl_sync(kAllLanes, corner.y, 0)};
  // Adding 0 does not change the sum.
  const bool is_between = lane > 0 && lane + 1 < count;
  const float twice_area = sum_in_order(is_between ? cross(corner - first, next - first) : 0.0f);
  if (fabsf(twice_area) < kMinTwiceArea_px2) return false;
  const bool is_clockwise = twice_area > 0.0f;
  const bool is_edge = is_corner && (corner.x != next.x || corner.y != next.y);
  const unsigned edges = __ballot_sync(kAllLanes, is_edge);
  if (is_edge) {
    store_words(context.edges + edge_begin + __popc(edges & lanes_below()),
                make_edge(is_clockwise ? corner : next, is_clockwise ? next : corner));
  }
  face_out->edge_count = static_cast<uint8_t>(__popc(edges));
  face_out->color = face.color;
  set_bounds(camera, context.setting.frustum, bounds, face.plane, face_out);
  return true;
}

}  // namespace pictura::cuda
