// Culling of eight pieces of a map in parallel (SIMD), by the rules of common/raster/cull.h.
#pragma once

#include <algorithm>
#include <bit>
#include <vector>

#include "pictura/backend_cpu/renderer/fast/vectors_x8.h"
#include "pictura/common/grid.h"
#include "pictura/common/raster/cull.h"

namespace pictura {

inline Vec3x8 to_camera(const PinholeCamera& camera, const Vec3x8& world_m) {
  const Vec3x8 d{world_m.x - camera.position_m.x, world_m.y - camera.position_m.y, world_m.z - camera.position_m.z};
  auto along = [&d](Vec3 axis) { return axis.x * d.x + axis.y * d.y + axis.z * d.z; };
  return {along(camera.right), along(camera.down), along(camera.forward)};
}

inline Mask8 sphere_in_frustum(const Frustum& f, const Vec3x8& center, Float8 radius_m) {
  const Mask8 in_range = (center.z + radius_m > kNear_m) & (center.z - radius_m < kVisibleRange_m);
  const Mask8 in_width = ((center.x - f.x_low * center.z) * f.x_low_scale > -radius_m) &
                         ((f.x_high * center.z - center.x) * f.x_high_scale > -radius_m);
  const Mask8 in_height = ((center.y - f.y_low * center.z) * f.y_low_scale > -radius_m) &
                          ((f.y_high * center.z - center.y) * f.y_high_scale > -radius_m);
  return in_range & in_width & in_height;
}

/// Bounding balls of a grid's items.
class BallGrid {
 public:
  struct Ball {
    Vec3 middle_m;
    float radius_m = 0;
  };
  /// ball_of(item): the item's bounding ball. box_of(item): the box with which the grid was built.
  template <typename BallOf, typename BoxOf>
  BallGrid(const GridView& grid, BallOf&& ball_of, BoxOf&& box_of) : grid_(grid) {
    const std::size_t padded = grid.items.size() + kLanes;
    for (std::vector<float>* of : {&x_m_, &y_m_, &z_m_, &radius_m_}) of->resize(padded);
    starts_.resize(padded);
    if (grid.items.empty()) return;
    for (int y = 0; y < grid.num_y; ++y) {
      for (int x = 0; x < grid.num_x; ++x) {
        for (int32_t i = begin(x, y); i < begin(x + 1, y); ++i) {
          const Ball ball = ball_of(grid.items[i]);
          const Aabb2 box = box_of(grid.items[i]);
          x_m_[i] = ball.middle_m.x;
          y_m_[i] = ball.middle_m.y;
          z_m_[i] = ball.middle_m.z;
          radius_m_[i] = ball.radius_m;
          starts_[i] = static_cast<uint8_t>((x == grid.cell_x(box.low.x) ? kStartsColumn : 0) |
                                            (y == grid.cell_y(box.low.y) ? kStartsRow : 0));
        }
      }
    }
  }

  /// Like for_each_item(), but visits only items whose ball is in the frustum.
  template <typename Visit>
  void visit_visible(const PinholeCamera& camera, const Frustum& f, const Aabb2& query_box, Visit&& visit) const {
    const CellRange cells = cells_of(grid_, query_box);
    for (int y = cells.y_begin; y < cells.y_end; ++y) {
      // An item is visited only in the query's first column and row that contain it.
      const int32_t first_column_end = begin(cells.x_begin + 1, y), row_end = begin(cells.x_end, y);
      const int row_starts = y == cells.y_begin ? kStartsRow : 0;
      for (int32_t i = begin(cells.x_begin, y); i < row_end; i += kLanes) {
        const Vec3x8 middle_m{load8(&x_m_[i]), load8(&y_m_[i]), load8(&z_m_[i])};
        unsigned lanes = bits_of(sphere_in_frustum(f, to_camera(camera, middle_m), load8(&radius_m_[i])));
        lanes &= first_lanes_mask(row_end - i);
        for (; lanes != 0; lanes &= lanes - 1) {
          const int32_t at = i + std::countr_zero(lanes);
          const int starts = starts_[at] | row_starts | (at < first_column_end ? kStartsColumn : 0);
          if (starts == (kStartsColumn | kStartsRow)) visit(grid_.items[at]);
        }
      }
    }
  }

 private:
  static constexpr int kStartsColumn = 1, kStartsRow = 2;
  // Index of the first item of a cell, or of the next row if x is num_x.
  int32_t begin(int x, int y) const {
    return grid_
        .begin[static_cast<std::size_t>(y) * static_cast<std::size_t>(grid_.num_x) + static_cast<std::size_t>(x)];
  }

  GridView grid_;
  // Centres and radii of the grid's items, padded by one vector.
  std::vector<float> x_m_, y_m_, z_m_, radius_m_;
  std::vector<uint8_t> starts_;  // bits: whether the item's box begins in this cell's column and row
};

/// Bounding balls, sorted by the cells of their centres.
class CenteredBalls {
 public:
  explicit CenteredBalls(const std::vector<BallGrid::Ball>& balls)
      : grid_(make_grid(balls)),
        balls_(
            grid_.view(), [&balls](int32_t i) { return balls[i]; },
            [&balls](int32_t i) { return center_of(balls[i]); }) {
    for (const BallGrid::Ball& ball : balls) largest_radius_m_ = max_of(largest_radius_m_, ball.radius_m);
  }
  CenteredBalls(const CenteredBalls&) = delete;
  CenteredBalls& operator=(const CenteredBalls&) = delete;

  /// Writes the indices of the balls in the frustum, in ascending order.
  void find_visible(const PinholeCamera& camera, const Frustum& f, std::vector<int32_t>* found_out) const {
    found_out->clear();
    const Aabb2 box = ground_box_of_spheres(camera, f, largest_radius_m_);
    balls_.visit_visible(camera, f, {within_bounds(box.low), within_bounds(box.high)},
                         [found_out](int32_t i) { found_out->push_back(i); });
    std::sort(found_out->begin(), found_out->end());
  }

 private:
  /// Clamps positions far outside any map, so that the grid stays small.
  static Vec2 within_bounds(Vec2 p) {
    constexpr float kBound_m = 1e6f;
    return {clamp(p.x, -kBound_m, kBound_m), clamp(p.y, -kBound_m, kBound_m)};
  }
  static Aabb2 center_of(const BallGrid::Ball& ball) {
    const Vec2 center = within_bounds(ball.middle_m.xy());
    return {center, center};
  }
  static Grid make_grid(const std::vector<BallGrid::Ball>& balls) {
    std::vector<Aabb2> centers;
    for (const BallGrid::Ball& ball : balls) centers.push_back(center_of(ball));
    Aabb2 all = centers.empty() ? Aabb2{} : centers[0];
    for (const Aabb2& center : centers) {
      all.low = {min_of(all.low.x, center.low.x), min_of(all.low.y, center.low.y)};
      all.high = {max_of(all.high.x, center.high.x), max_of(all.high.y, center.high.y)};
    }
    constexpr float kMinCell_m = 16.0f, kMaxCellsInRow = 64.0f;
    const float extent_m = max_of(all.high.x - all.low.x, all.high.y - all.low.y);
    return Grid(centers, max_of(kMinCell_m, extent_m / kMaxCellsInRow));
  }

  Grid grid_;
  BallGrid balls_;
  float largest_radius_m_ = 0;
};

/// Drawn boxes of a world with many agents, sorted by cells.
class Crowd {
 public:
  explicit Crowd(Span<const AgentBox> boxes) : agents_(drawn(boxes)), balls_(balls_of(boxes, agents_)) {}
  /// Writes the indices of boxes that may be visible, in ascending order.
  void find_visible(const PinholeCamera& camera, const Frustum& f, std::vector<int32_t>* found_out) const {
    balls_.find_visible(camera, f, found_out);
    for (int32_t& found : *found_out) found = agents_[found];
  }

 private:
  static std::vector<int32_t> drawn(Span<const AgentBox> boxes) {
    std::vector<int32_t> agents;
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      if (boxes[i].drawn) agents.push_back(static_cast<int32_t>(i));
    }
    return agents;
  }
  static std::vector<BallGrid::Ball> balls_of(Span<const AgentBox> boxes, const std::vector<int32_t>& agents) {
    std::vector<BallGrid::Ball> balls;
    for (const int32_t agent : agents) balls.push_back({box_middle(boxes[agent]), box_radius_m(boxes[agent])});
    return balls;
  }

  std::vector<int32_t> agents_;
  CenteredBalls balls_;
};

struct CulledGeometry {
  /// The view's arrays must outlive the object.
  explicit CulledGeometry(const StaticGeometryView& geometry)
      : view(geometry),
        strips(
            geometry.strip_grid,
            [&](int32_t i) {
              const Strip& strip = geometry.strips[i];
              return BallGrid::Ball{strip_middle(strip), strip_radius_m(strip)};
            },
            [&](int32_t i) { return ground_box(geometry.strips[i]); }),
        walls(
            geometry.wall_grid,
            [&](int32_t i) {
              const WallFace& wall = geometry.walls[i];
              return BallGrid::Ball{wall_middle(wall), wall_radius_m(wall)};
            },
            [&](int32_t i) { return ground_box(geometry.walls[i]); }),
        heads(balls_of(geometry.heads)) {}
  StaticGeometryView view;
  BallGrid strips, walls;
  CenteredBalls heads;

 private:
  static std::vector<BallGrid::Ball> balls_of(Span<const LightHead> heads) {
    std::vector<BallGrid::Ball> balls;
    for (const LightHead& head : heads) balls.push_back({head.position_m, kHeadRadius_m});
    return balls;
  }
};

}  // namespace pictura
