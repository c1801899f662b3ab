// The scene: all data that a simulator and a renderer exchange. StaticGeometry is the drawn part of a map, uploaded
// once. SceneBatch is everything that moves, written in every step. A View places a rig. The plain data types are in
// scene_types.h.
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

/// A SceneBatch with its memory, on the host.
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

/// Makes a drawn box in the colours of its class; size_m is its length, width and height.
AgentBox make_box(AgentClass agent_class, Vec3 center_m, float heading_rad, Vec3 size_m);

/// Makes a view at a pose; it hides no agent.
View make_view(Vec3 origin_m, float heading_rad);

/// Views of a call. If num_views is given, it lies on the device of the views, and only views [0, *num_views) are read.
/// So a list of views that a device compacted can be drawn without waiting for the host.
struct ViewBatch {
  Span<const View> views;
  const int32_t* num_views = nullptr;

  ViewBatch() = default;
  ViewBatch(Span<const View> all, const int32_t* count = nullptr) : views(all), num_views(count) {}  // NOLINT: converts
  ViewBatch(const std::vector<View>& all, const int32_t* count = nullptr)                            // NOLINT: converts
      : views(all), num_views(count) {}
  std::size_t size() const { return views.size(); }
};

/// Minimum distance in plan between consecutive points of a polyline; closer points are dropped.
constexpr float kRepeatedPoint_m = 1e-4f;
/// Cuts polylines (at least two points each) into mitred strips of at most kMaxPiece_m and appends these strips.
void append_strips(Span<const Vec3> points_m, float width_m, Rgb color, StripKind kind, std::vector<Strip>* strips_out);

}  // namespace pictura
