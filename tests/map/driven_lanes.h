// Counts the poses at which a car in mid-lane touches road edges.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "pictura/common/scene.h"
#include "pictura/map/road_map.h"

namespace pictura::test {

class EdgeGrid {
 public:
  explicit EdgeGrid(const RoadMap& map) : edges_(map.road_edges) {
    std::vector<Aabb2> boxes;
    for (const RoadEdge& edge : edges_) {
      boxes.push_back({{min_of(edge.a_m.x, edge.b_m.x), min_of(edge.a_m.y, edge.b_m.y)},
                       {max_of(edge.a_m.x, edge.b_m.x), max_of(edge.a_m.y, edge.b_m.y)}});
    }
    grid_ = Grid(boxes, 10.0f);
  }

  /// Whether test(edge) is true for any edge at the height of p, at most about radius_m from p along x and y.
  template <typename Test>
  bool any_near(Vec3 p, float radius_m, Test&& test) const {
    const GridView grid = grid_.view();
    for (int y = grid.cell_y(p.y - radius_m); y <= grid.cell_y(p.y + radius_m); ++y) {
      for (int x = grid.cell_x(p.x - radius_m); x <= grid.cell_x(p.x + radius_m); ++x) {
        const std::size_t cell = static_cast<std::size_t>(y * grid.num_x + x);
        for (int32_t i = grid.begin[cell]; i < grid.begin[cell + 1]; ++i) {
          const RoadEdge& edge = edges_[grid.items[i]];
          if (std::abs(0.5f * (edge.a_m.z + edge.b_m.z) - p.z) < 2.0f && test(edge)) return true;
        }
      }
    }
    return false;
  }

 private:
  const std::vector<RoadEdge>& edges_;
  Grid grid_;
};

/// Whether an edge intersects a box of 2 * half_length by 2 * half_width on the ground plane.
inline bool box_intersects(const RoadEdge& edge, Vec3 center, float heading_rad, float half_length, float half_width) {
  const float c = std::cos(heading_rad), s = std::sin(heading_rad);
  auto local = [&](Vec3 p) {
    const float dx = p.x - center.x, dy = p.y - center.y;
    return Vec2{dx * c + dy * s, -dx * s + dy * c};
  };
  const Vec2 a = local(edge.a_m), d = local(edge.b_m) - a;
  float low = 0, high = 1;
  const std::array<std::array<float, 3>, 2> slabs{{{a.x, d.x, half_length}, {a.y, d.y, half_width}}};
  for (const auto& [start, step, half] : slabs) {
    if (step == 0) {
      if (std::abs(start) > half) return false;
      continue;
    }
    const float u = (-half - start) / step, v = (half - start) / step;
    low = max_of(low, min_of(u, v));
    high = min_of(high, max_of(u, v));
  }
  return low <= high;
}

struct DrivenLanes {
  int poses = 0, touching = 0;
};

/// Places a car of 4.5 x 2 m at every half metre of every driving lane.
inline DrivenLanes drive_lanes(const RoadMap& map) {
  const EdgeGrid edges(map);
  DrivenLanes driven;
  for (const Lane& lane_to_drive : map.lanes) {
    if (lane_to_drive.type != LaneType::driving) continue;
    const Span<const LanePoint> points = map.points_of(lane_to_drive);
    for (std::size_t i = 1; i < points.size(); ++i) {
      const LanePoint &a = points[i - 1], &b = points[i];
      for (float u = 0; u < 1; u += 0.5f / (b.s_m - a.s_m)) {
        // Skips places where a lane has almost no width.
        bool tapers = false;
        for (const LanePoint& near : points) {
          tapers = tapers || (near.width_m < 0.05f && std::abs(near.s_m - a.s_m - u * (b.s_m - a.s_m)) < 30.0f);
        }
        if (tapers) continue;
        ++driven.poses;
        const Vec3 center = a.position_m + (b.position_m - a.position_m) * u;
        const float heading = a.heading_rad + u * wrap_angle(b.heading_rad - a.heading_rad);
        const bool touches = edges.any_near(
            center, 2.5f, [&](const RoadEdge& edge) { return box_intersects(edge, center, heading, 2.25f, 1.0f); });
        driven.touching += touches ? 1 : 0;
      }
    }
  }
  return driven;
}

}  // namespace pictura::test
