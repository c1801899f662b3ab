// The scene: all data that a simulator and a renderer exchange. StaticGeometry is uploaded once. SceneBatch is written
// in every step.
#pragma once

#include <vector>

#include "pictura/common/grid.h"
#include "pictura/common/scene_types.h"

namespace pictura {

/// The drawn part of a map, shared by all worlds on the map.
struct StaticGeometry {
  std::vector<Strip> strips;
  std::vector<WallFace> walls;
  std::vector<LightHead> heads;
  Grid strip_grid, wall_grid;
  int32_t num_signals = 0;

  /// Fills both grids from the strips and walls.
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
  /// Ends a world. All agents and lights added since the previous call belong to it.
  void end_world(GeometryHandle handle) {
    world_begin.push_back(static_cast<int32_t>(agents.size()));
    light_begin.push_back(static_cast<int32_t>(light_states.size()));
    geometry.push_back(handle);
  }
};

/// Makes a box in the colours of its class. size_m is (length, width, height).
AgentBox make_box(AgentClass agent_class, Vec3 center_m, float heading_rad, Vec3 size_m);

/// Makes a view that hides no agent.
View make_view(Vec3 origin_m, float heading_rad);

/// Views of one call to a renderer. If num_views is not null, only the first *num_views views are read. num_views
/// points to memory on the device of the views, so that kernels can write it.
struct ViewBatch {
  Span<const View> views;
  const int32_t* num_views = nullptr;

  ViewBatch() = default;
  ViewBatch(Span<const View> all, const int32_t* count = nullptr) : views(all), num_views(count) {}  // NOLINT: converts
  ViewBatch(const std::vector<View>& all, const int32_t* count = nullptr)                            // NOLINT: converts
      : views(all), num_views(count) {}
  std::size_t size() const { return views.size(); }
};

/// Minimum distance, on the ground plane, of consecutive points. Closer points are dropped.
constexpr float kRepeatedPoint_m = 1e-4f;
/// Cuts a polyline of at least two points into mitred strips of at most kMaxPiece_m.
void append_strips(Span<const Vec3> points_m, float width_m, Rgb color, StripKind kind, std::vector<Strip>* strips_out);

}  // namespace pictura
