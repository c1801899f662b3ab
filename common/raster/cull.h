// Culling: selection of the primitives that an image may show. For host and CUDA code.
#pragma once

#include "pictura/common/portable/intrinsics.h"
#include "pictura/common/raster/camera.h"
#include "pictura/common/raster/shapes.h"

namespace pictura {

PICTURA_HD inline Vec3 strip_middle(const Strip& strip) { return (strip.a_m + strip.b_m) * 0.5f; }

/// Upper bound of a strip's radius.
PICTURA_HD inline float strip_radius_m(const Strip& strip) {
  const float side = max_of(length(strip.side_a), length(strip.side_b));
  return 0.5f * (length(strip.b_m - strip.a_m) + side * strip.width_m);
}

PICTURA_HD inline Vec3 wall_middle(const WallFace& wall) {
  return (wall.a_m + wall.b_m) * 0.5f + Vec3{0.0f, 0.0f, 0.5f * wall.height_m};
}

PICTURA_HD inline float wall_radius_m(const WallFace& wall) {
  return 0.5f * (length(wall.b_m - wall.a_m) + wall.height_m);
}

/// Bounding radius of a light's disk, which is drawn as a polygon of equal area.
constexpr float kHeadRadius_m = 1.1f * kLightRadius_m;

PICTURA_HD inline Vec3 box_middle(const AgentBox& box) { return box.center_m + Vec3{0.0f, 0.0f, 0.5f * box.height_m}; }
PICTURA_HD inline float box_radius_m(const AgentBox& box) {
  const Vec3 size{box.length_m, box.width_m, box.height_m};
  return 0.5f * sqrt_in_range(max_no_nan(dot(size, size), 1e-12f));
}

PICTURA_HD inline bool may_be_visible(const Strip& strip, const PinholeCamera& camera, const Frustum& f) {
  // The radius excludes the strip's widening on screen, because the frustum's guard band is wider.
  return sphere_in_frustum(f, to_camera(camera, strip_middle(strip)), strip_radius_m(strip));
}

PICTURA_HD inline bool may_be_visible(const WallFace& wall, const PinholeCamera& camera, const Frustum& f) {
  return sphere_in_frustum(f, to_camera(camera, wall_middle(wall)), wall_radius_m(wall));
}

PICTURA_HD inline bool may_be_visible(const LightHead& head, const PinholeCamera& camera, const Frustum& f) {
  return sphere_in_frustum(f, to_camera(camera, head.position_m), kHeadRadius_m);
}

PICTURA_HD inline bool may_be_visible(const AgentBox& box, const PinholeCamera& camera, const Frustum& f) {
  return box.drawn != 0 && sphere_in_frustum(f, to_camera(camera, box_middle(box)), box_radius_m(box));
}

/// Whether a view's images omit an agent.
PICTURA_HD inline bool is_excluded(const View& view, Span<const int32_t> hidden_agents, int32_t agent) {
  if (agent == view.ego_agent || (view.hides & kHidesAgents) != 0) return true;
  for (int32_t i = view.hidden_begin; i < view.hidden_end; ++i) {
    if (hidden_agents[i] == agent) return true;
  }
  return false;
}

/// Calls visit(item) once for each item in the cells that a box touches. box_of(item) must be the item's box in the
/// grid.
template <typename BoxOf, typename Visit>
PICTURA_HD inline void for_each_item(const GridView& grid, const Aabb2& query_box, BoxOf&& box_of, Visit&& visit) {
  const CellRange cells = cells_of(grid, query_box);
  const int columns = cells.x_end - cells.x_begin;
  const int count = columns * (cells.y_end - cells.y_begin);
  for (int cell = 0; cell < count; ++cell) {
    const int x = cells.x_begin + cell % columns, y = cells.y_begin + cell / columns;
    const size_t at = static_cast<size_t>(y) * static_cast<size_t>(grid.num_x) + static_cast<size_t>(x);
    for (int32_t i = grid.begin[at]; i < grid.begin[at + 1]; ++i) {
      const int32_t item = grid.items[i];
      if (is_first_visit(grid, cells, box_of(item), x, y)) visit(item);
    }
  }
}

}  // namespace pictura
