// The scene: all data that a simulator and a renderer exchange. StaticGeometry is the drawn part of a map, which is
// uploaded once. SceneBatch holds everything that moves or changes, and is written in every step. A View is the pose of
// a camera rig. The plain data types are in scene_types.h.
#pragma once

#include <vector>

#include "pictura/common/grid.h"
#include "pictura/common/scene_types.h"

namespace pictura {

/// The drawn part of a map; shared by all worlds on the map.
struct StaticGeometry {
  std::vector<Strip> strips;
  std::vector<WallFace> walls;
  std::vector<LightHead> heads;
  Grid strip_grid, wall_grid;
  int32_t num_signals = 0;

  /// Fills both grids from strips and walls; call after the vectors are complete.
  void build_grids();
  StaticGeometryView view() const { return {strips, walls, heads, strip_grid.view(), wall_grid.view(), num_signals}; }
};

/// Owner of a SceneBatch in host memory.
struct SceneOwner {
  std::vector<int32_t> world_begin{0};
  std::vector<AgentBox> agents;
  std::vector<GeometryHandle> geometry;
  std::vector<int32_t> light_begin{0};
  std::vector<LightState> light_states;
  std::vector<int32_t> hidden_agents;

  SceneBatch batch() const {
    return {Device{}, world_begin, agents, geometry, light_begin, light_states, hidden_agents};
  }
  /// Ends a world: agents and lights added since the last call belong to it.
  void end_world(GeometryHandle handle) {
    world_begin.push_back(static_cast<int32_t>(agents.size()));
    light_begin.push_back(static_cast<int32_t>(light_states.size()));
    geometry.push_back(handle);
  }
};

/// Makes a box that is drawn in the colours of its class. size_m is (length, width, height).
AgentBox make_box(AgentClass agent_class, Vec3 center_m, float heading_rad, Vec3 size_m);

/// Makes a view at a pose. The view hides no agent.
View make_view(Vec3 origin_m, float heading_rad);

/// Views of one call to a renderer. If num_views is not null, it points to memory on the device of the views, and only
/// views [0, *num_views) are read. So a list of views that a kernel has compacted can be drawn without copying its
/// length to the host.
struct ViewBatch {
  Span<const View> views;
  const int32_t* num_views = nullptr;

  ViewBatch() = default;
  ViewBatch(Span<const View> all, const int32_t* count = nullptr) : views(all), num_views(count) {}  // NOLINT: converts
  ViewBatch(const std::vector<View>& all, const int32_t* count = nullptr)                            // NOLINT: converts
      : views(all), num_views(count) {}
  std::size_t size() const { return views.size(); }
};

/// Minimum distance on the ground plane between consecutive points of a polyline; closer points are dropped.
constexpr float kRepeatedPoint_m = 1e-4f;
/// Cuts a polyline of at least two points into mitred strips of at most kMaxPiece_m, and appends the strips.
void append_strips(Span<const Vec3> points_m, float width_m, Rgb color, StripKind kind, std::vector<Strip>* strips_out);

}  // namespace pictura
