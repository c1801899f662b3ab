// Synthetic scenes for tests and benchmarks of renderers: streets with lane marks, edges, crosswalks, cars, people,
// walls and lights, drawn from a seed, with disjoint footprints.
#pragma once

#include <vector>

#include "pictura/common/renderer.h"

namespace pictura {

/// A scene with its memory. `batch()` has one world per geometry handle given.
struct SceneOwner {
  std::vector<int32_t> world_begin{0};
  std::vector<AgentBox> agents;
  std::vector<GeometryHandle> geometry;
  std::vector<int32_t> light_begin{0};
  std::vector<LightState> light_states;
  std::vector<int32_t> hidden_agents;

  SceneBatch batch() const {
    return {MemorySpace::host, world_begin, agents, geometry, light_begin, light_states, hidden_agents};
  }
  /// Closes a world: agents and lights added since the last call belong to it.
  void end_world(GeometryHandle handle) {
    world_begin.push_back(static_cast<int32_t>(agents.size()));
    light_begin.push_back(static_cast<int32_t>(light_states.size()));
    geometry.push_back(handle);
  }
};

AgentBox make_box(AgentClass agent_class, Vec3 center_m, float heading_rad, Vec3 size_m);

/// A view at a pose, with nobody left out.
View make_view(Vec3 origin_m, float heading_rad);

/// Appends the outline of a ring or line as strips, with white marks unless said otherwise.
void add_polyline(StaticGeometry* geometry, std::vector<Vec3> points_m, float width_m, StripKind kind);

/// A town-like scene: a grid of streets 60 m apart, crosswalks and lights at crossings, walls along blocks, and
/// `num_agents` agents that stand on the streets, none touching another.
struct SyntheticTown {
  StaticGeometry geometry;
  SceneOwner scene;         // one world with handle 0
  std::vector<View> views;  // one per vehicle, ego left out
};
SyntheticTown make_synthetic_town(uint64_t seed, int num_agents);

}  // namespace pictura
