// Whether a position is on the road's side of the road edges, for maps without road surface. Shared by CPU and GPU
// code.
#pragma once

#include "pictura/common/cells_around.h"
#include "pictura/common/math.h"

namespace pictura {

/// An edge with the road on its right.
struct SideEdge {
  Vec3 a_m, b_m;
  Vec2 left;                       // unit normal, away from the road
  int32_t before = -1, next = -1;  // edges that meet the start and the end; -1: none
};

struct RoadSide {
  int32_t edge = -1;       // -1: none within kRoadSideReach_m
  float distance_m = 0;    // differences in height count threefold
  bool is_on_road = true;  // true if there is no edge
};
constexpr float kRoadSideReach_m = 50.0f;

/// Thread group of a single thread. Larger groups share the loops.
struct NoGroup {
  PICTURA_HD static int rank() { return 0; }
  PICTURA_HD static int size() { return 1; }
  template <typename T>
  PICTURA_HD static T of_lowest(float, int, const T& value) {
    return value;
  }
};

/// Returns the side of the nearest edge, the first one if several are equally near. Differences in height count
/// threefold, so that a bridge's edges are not nearest to traffic below it. At a corner, the sum of both normals
/// determines the side (Baerentzen and Aanaes, Signed distance computation using the angle weighted pseudonormal,
/// 2005). `cells` is a grid of the edges.
template <typename ThreadGroup = NoGroup>
PICTURA_HD RoadSide road_side(Span<const SideEdge> edges, const GridView& cells, Vec3 position_m,
                              const ThreadGroup& group = {}) {
  constexpr float kHeightWeight = 3.0f;
  RoadSide best;
  best.distance_m = kRoadSideReach_m;
  if (edges.empty()) return {};
  const Vec2 p = position_m.xy();
  const auto visit_edge = [&](int32_t index) {
    const SideEdge& edge = edges[index];
    const Vec2 a = edge.a_m.xy(), way = (edge.b_m - edge.a_m).xy();
    const float t = clamp(dot(p - a, way) / max_of(dot(way, way), 1e-12f), 0.0f, 1.0f);
    const Vec2 away = p - (a + way * t);
    const float dz = kHeightWeight * (position_m.z - (edge.a_m.z + t * (edge.b_m.z - edge.a_m.z)));
    const float distance_m = sqrtf(dot(away, away) + dz * dz);
    if (distance_m > best.distance_m || (distance_m == best.distance_m && (best.edge < 0 || index >= best.edge))) {
      return;
    }
    Vec2 normal = edge.left;
    const int32_t neighbor = t <= 0.0f ? edge.before : t >= 1.0f ? edge.next : -1;
    if (neighbor >= 0) normal = normal + edges[neighbor].left;
    best = {index, distance_m, dot(away, normal) <= 0.0f};
  };
  // Small areas are searched first, because the nearest edge is usually near.
  const float reaches_m[] = {5.0f, 15.0f, kRoadSideReach_m};
  for (const float reach_m : reaches_m) {
    const CellRows range = cells_around(cells, p, reach_m);
    for (int y = range.y0; y <= range.y1; ++y) {
      const int32_t end = range.end(cells, y);
      for (int32_t i = range.begin(cells, y) + group.rank(); i < end; i += group.size()) {
        visit_edge(cells.items[i]);
      }
    }
    best = group.of_lowest(best.distance_m, best.edge < 0 ? static_cast<int>(edges.size()) : best.edge, best);
    if (best.edge >= 0 && best.distance_m <= reach_m) break;
  }
  if (best.edge < 0) best.distance_m = 0;
  return best;
}

}  // namespace pictura
