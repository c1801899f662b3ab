// Cameras of the rasterizers, for host and CUDA code. Camera coordinates are (right, down, forward) in metres. The
// depth is the third coordinate.
#pragma once

#include "pictura/common/color.h"
#include "pictura/common/portable/intrinsics.h"
#include "pictura/common/scene_types.h"

namespace pictura {

constexpr float kNear_m = 0.1f;
/// Width of the guard band: polygons are clipped this far outside the image. Most polygons then need no clipping, and
/// screen coordinates keep their precision.
constexpr float kGuardBand_px = 8.0f;

constexpr int kMaxCameras = 64;

/// A camera of a rig (in the ego frame) or of a view (in the world).
struct PinholeCamera {
  Vec3 position_m;
  Vec3 right, down, forward;
  float focal_x_px = 0, focal_y_px = 0, center_x_px = 0, center_y_px = 0;
  int32_t width_px = 0, height_px = 0;
};

/// Places a rig's camera at a view's pose. The camera's x offset shrinks for bodies shorter than
/// View::kRigBodyLength_m.
PICTURA_HD inline PinholeCamera place_camera(const PinholeCamera& in_ego, const View& view) {
  const float shrink = min_of(1.0f, view.body_length_m / View::kRigBodyLength_m);
  const float c = view.cos_heading, s = view.sin_heading;
  const Vec3 p{in_ego.position_m.x * shrink, in_ego.position_m.y, in_ego.position_m.z};
  auto turned = [&](Vec3 v) { return Vec3{v.x * c - v.y * s, v.x * s + v.y * c, v.z}; };
  PinholeCamera camera = in_ego;
  camera.position_m = view.origin_m + turned(p);
  camera.right = turned(in_ego.right);
  camera.down = turned(in_ego.down);
  camera.forward = turned(in_ego.forward);
  return camera;
}

PICTURA_HD inline Vec3 to_camera(const PinholeCamera& camera, Vec3 world_m) {
  const Vec3 d = world_m - camera.position_m;
  return {dot(camera.right, d), dot(camera.down, d), dot(camera.forward, d)};
}

/// View frustum, including the guard band. It holds the slopes x/depth and y/depth of the sides, scales for distances
/// to the sides, and the slopes' change per pixel.
struct Frustum {
  float x_low = 0, x_high = 0, y_low = 0, y_high = 0;
  float x_low_scale = 0, x_high_scale = 0, y_low_scale = 0, y_high_scale = 0;
  float x_per_px = 0, y_per_px = 0;
};

PICTURA_HD inline Frustum make_frustum(const PinholeCamera& camera) {
  Frustum f;
  f.x_per_px = reciprocal_in_range(camera.focal_x_px);
  f.y_per_px = reciprocal_in_range(camera.focal_y_px);
  f.x_low = (-kGuardBand_px - camera.center_x_px) * f.x_per_px;
  f.x_high = (static_cast<float>(camera.width_px) + kGuardBand_px - camera.center_x_px) * f.x_per_px;
  f.y_low = (-kGuardBand_px - camera.center_y_px) * f.y_per_px;
  f.y_high = (static_cast<float>(camera.height_px) + kGuardBand_px - camera.center_y_px) * f.y_per_px;
  auto scale = [](float slope) { return reciprocal_in_range(sqrt_in_range(1.0f + slope * slope)); };
  f.x_low_scale = scale(f.x_low);
  f.x_high_scale = scale(f.x_high);
  f.y_low_scale = scale(f.y_low);
  f.y_high_scale = scale(f.y_high);
  return f;
}

/// Whether a sphere (camera coordinates) may be visible. False if it is entirely outside one plane or beyond the
/// visible range.
PICTURA_HD inline bool sphere_in_frustum(const Frustum& f, Vec3 center, float radius_m) {
  // No short circuits, because lanes of a warp would diverge.
  const bool in_range = (center.z + radius_m > kNear_m) & (center.z - radius_m < kVisibleRange_m);
  const bool in_width = ((center.x - f.x_low * center.z) * f.x_low_scale > -radius_m) &
                        ((f.x_high * center.z - center.x) * f.x_high_scale > -radius_m);
  const bool in_height = ((center.y - f.y_low * center.z) * f.y_low_scale > -radius_m) &
                         ((f.y_high * center.z - center.y) * f.y_high_scale > -radius_m);
  return in_range & in_width & in_height;
}

/// Corner 0 to 3 of the frustum at the visible range, in world coordinates.
PICTURA_HD inline Vec3 far_corner(const PinholeCamera& camera, const Frustum& f, int corner) {
  const float x = (corner & 1) ? f.x_high : f.x_low;
  const float y = (corner & 2) ? f.y_high : f.y_low;
  return camera.position_m + (camera.right * x + camera.down * y + camera.forward) * kVisibleRange_m;
}

/// Bounding box of the frustum within the visible range, on the ground plane.
PICTURA_HD inline Aabb2 frustum_ground_box(const PinholeCamera& camera, const Frustum& f) {
  Aabb2 box{camera.position_m.xy(), camera.position_m.xy()};
  for (int corner = 0; corner < 4; ++corner) {
    const Vec3 p = far_corner(camera, f, corner);
    box.low = {min_of(box.low.x, p.x), min_of(box.low.y, p.y)};
    box.high = {max_of(box.high.x, p.x), max_of(box.high.y, p.y)};
  }
  return box;
}

/// Bounding box, on the ground plane, of the centres of spheres up to this radius that sphere_in_frustum() accepts.
PICTURA_HD inline Aabb2 ground_box_of_spheres(const PinholeCamera& camera, const Frustum& f, float radius_m) {
  const float leeway_m = 0.01f * radius_m + 0.1f;  // above the rounding errors of coordinate sums
  const float reach_m = radius_m + leeway_m;
  Aabb2 box;
  for (int corner = 0; corner < 8; ++corner) {
    const float z = (corner & 4) ? kVisibleRange_m + reach_m : kNear_m - reach_m;
    const float x = (corner & 1) ? f.x_high * z + reach_m * reciprocal_in_range(f.x_high_scale)
                                 : f.x_low * z - reach_m * reciprocal_in_range(f.x_low_scale);
    const float y = (corner & 2) ? f.y_high * z + reach_m * reciprocal_in_range(f.y_high_scale)
                                 : f.y_low * z - reach_m * reciprocal_in_range(f.y_low_scale);
    const Vec3 p = camera.position_m + (camera.right * x + camera.down * y + camera.forward * z);
    box.low = corner == 0 ? p.xy() : Vec2{min_of(box.low.x, p.x), min_of(box.low.y, p.y)};
    box.high = corner == 0 ? p.xy() : Vec2{max_of(box.high.x, p.x), max_of(box.high.y, p.y)};
  }
  return box;
}

/// Cells of a grid that a box touches, as half-open ranges.
struct CellRange {
  int x_begin = 0, x_end = 0, y_begin = 0, y_end = 0;
};

PICTURA_HD inline CellRange cells_of(const GridView& grid, const Aabb2& box) {
  if (grid.items.empty()) return {};
  return {grid.cell_x(box.low.x), grid.cell_x(box.high.x) + 1, grid.cell_y(box.low.y), grid.cell_y(box.high.y) + 1};
}

/// Whether (cell_x, cell_y) is the item's first cell within the query.
PICTURA_HD inline bool is_first_visit(const GridView& grid, const CellRange& query, const Aabb2& item_box, int cell_x,
                                      int cell_y) {
  return cell_x == max_of(grid.cell_x(item_box.low.x), query.x_begin) &&
         cell_y == max_of(grid.cell_y(item_box.low.y), query.y_begin);
}

}  // namespace pictura
