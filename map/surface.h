// Surfaces as bands between two borders, with point queries: which bands cover a position.
#pragma once

#include <cstdint>
#include <vector>

#include "pictura/common/error.h"
#include "pictura/common/grid.h"
#include "pictura/map/polyline.h"

namespace pictura {

/// A piece of surface between two borders with equally many points; left is on the left in their direction. The surface
/// is bounded by straight segments between the points, so they must be dense enough.
struct SurfaceBand {
  std::vector<Eigen::Vector3d> left, right;
};

/// All quads of all bands in a grid. Bands at least `level_m` above or below a position do not cover it. The total
/// number of quads tested is bounded, far above what real road networks need; with excessively overlapping bands
/// any_band_at() throws Error instead of running for hours.
class Surface {
 public:
  Surface(const std::vector<SurfaceBand>& bands, double level_m);

  /// Quads of which at least one point within kNear_m of `p` may be covered: a superset, from the cell of `p`.
  struct Candidates {
    std::vector<int32_t> quads;
    bool are_complete = false;  // false where that circle is in several cells
  };

  /// Finds the quads about `p`, so that several questions about one place look them up once.
  void find_near(const Eigen::Vector2d& p, double z, Candidates* out) const;

  /// any_band_at() for a place within kNear_m of where the candidates were found.
  template <typename Visit>
  bool any_near(const Candidates& near, const Eigen::Vector2d& p, double z, Visit&& visit) const {
    if (!near.are_complete) return any_band_at(p, z, visit);
    for (const int32_t index : near.quads) {
      const Quad& quad = quads_[static_cast<std::size_t>(index)];
      if (contains(quad, p, z) && visit(quad.band)) return true;
    }
    return false;
  }
  static constexpr double kNear_m = 0.1;

  /// Calls visit(band) for every band that covers `p` at about height `z`, until it returns true; returns whether any
  /// call did.
  template <typename Visit>
  bool any_band_at(const Eigen::Vector2d& p, double z, Visit&& visit) const {
    const GridView grid = grid_.view();
    const Vec2 position{static_cast<float>(p.x()), static_cast<float>(p.y())};
    if (!grid.contains(position)) return false;
    const std::size_t cell = static_cast<std::size_t>(grid.cell_y(position.y)) * static_cast<std::size_t>(grid.num_x) +
                             static_cast<std::size_t>(grid.cell_x(position.x));
    count_lookups(grid.begin[cell + 1] - grid.begin[cell]);
    const float height = static_cast<float>(z);
    for (int32_t i = grid.begin[cell]; i < grid.begin[cell + 1]; ++i) {
      const QuadBounds& bounds = bounds_[static_cast<std::size_t>(i)];
      if (!bounds.contains(position, height)) continue;
      const Quad& quad = quads_[static_cast<std::size_t>(grid.items[static_cast<std::size_t>(i)])];
      if (contains(quad, p, z) && visit(quad.band)) return true;
    }
    return false;
  }

 private:
  struct Quad {
    Eigen::Vector3d corners[4];  // counter-clockwise: left, right, next right, next left
    int32_t band = 0;
  };

  /// Bounds outside of which a quad covers nothing, with a margin of kNear_m and for rounding.
  struct QuadBounds {
    Vec2 low, high;
    float low_z = 0, high_z = 0;

    bool contains(Vec2 p, float z) const {
      return p.x >= low.x && p.x <= high.x && p.y >= low.y && p.y <= high.y && z >= low_z && z <= high_z;
    }
  };

  QuadBounds bounds_of(const Quad& quad) const;
  bool contains(const Quad& quad, const Eigen::Vector2d& p, double z) const;
  void count_lookups(int64_t count) const {
    remaining_lookups_ -= count;
    if (remaining_lookups_ < 0) fail("too many overlapping lanes");
  }

  double level_m_ = 0;
  std::vector<Quad> quads_;
  Grid grid_;
  std::vector<QuadBounds> bounds_;  // [items of the grid], in its order: most of a cell's quads are ruled out by them
  mutable int64_t remaining_lookups_ = 0;
};

}  // namespace pictura
