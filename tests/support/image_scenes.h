// Synthetic scenes for tests and benchmarks of renderers: streets with lane marks, edges, crosswalks, cars, people,
// walls and lights, drawn from a seed, with disjoint footprints.
#pragma once

#include <vector>

#include "pictura/common/renderer.h"

namespace pictura {

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
