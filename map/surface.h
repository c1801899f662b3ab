// Surface of bands, with queries for the bands that cover a position.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <vector>

#include "pictura/common/error.h"
#include "pictura/common/grid.h"
#include "pictura/common/portable/float8.h"
#include "pictura/map/polyline.h"

namespace pictura {

/// Piece of a surface between two borders with equally many points. `left` is on the left in the direction of both.
struct SurfaceBand {
  std::vector<Eigen::Vector3d> left, right;
};

/// Grid of the quads of all bands. A band covers only positions less than `level_m` above or below it. Queries throw
/// Error after too many tests, so that overlapping bands do not cause hours of work. Real roads need far fewer tests.
class Surface {
 public:
  Surface(const std::vector<SurfaceBand>& bands, double level_m);

  /// Contains all quads that cover any point within kNear_m of the position given to find_near().
  struct Candidates {
    std::vector<int32_t> quads;
    bool are_complete = false;  // false if the circle of radius kNear_m is in several cells
  };

  /// Finds the candidates for several queries near `p`.
  void find_near(const Eigen::Vector2d& p, double z, Candidates* out) const;

  /// Whether a band with is_wanted(band) covers `p`. `p` must be within kNear_m of the position given to find_near().
  template <typename IsWanted>
  bool any_near(const Candidates& near, const Eigen::Vector2d& p, double z, IsWanted&& is_wanted) const {
    return any_near(near, p, z, is_wanted, [](int32_t) { return true; });
  }
  /// Calls visit(band) for wanted bands that cover `p`, until a call returns true. Returns whether one did.
  template <typename IsWanted, typename Visit>
  bool any_near(const Candidates& near, const Eigen::Vector2d& p, double z, IsWanted&& is_wanted, Visit&& visit) const {
    if (!near.are_complete) return any_band_at(p, z, [&](int32_t band) { return is_wanted(band) && visit(band); });
    for (const int32_t index : near.quads) {
      const Quad& quad = quads_[index];
      if (is_wanted(quad.band) && contains(quad, p, z) && visit(quad.band)) return true;
    }
    return false;
  }
  static constexpr double kNear_m = 0.1;

  /// Whether the band folds over itself at `p`, as in a turn tighter than its width. That is, a quad of the band covers
  /// `p` and is more than `reach_m` away from quad `from`, measured along the band.
  bool is_folded_over(const Candidates& near, const Eigen::Vector2d& p, double z, int32_t band, std::size_t from,
                      double reach_m) const;

  /// Calls visit(band) for every band that covers `p`, until a call returns true. Returns whether one did.
  template <typename Visit>
  bool any_band_at(const Eigen::Vector2d& p, double z, Visit&& visit) const {
    return any_quad_at(p, z, [&](const Quad& quad) { return contains(quad, p, z) && visit(quad.band); });
  }

 private:
  struct Quad {
    Eigen::Vector2d corners_m[4];  // counter-clockwise: left, right, next right, next left
    double mean_z_m = 0;
    double s_m = 0;  // arc length to the quad's middle, along the longer border
    int32_t band = 0;
  };

  /// Bounds of the positions that a quad covers, with a margin for kNear_m and rounding.
  struct QuadBounds {
    Vec2 low, high;
    float low_z = 0, high_z = 0;
  };
  /// Bounds in the order of the grid's items. Queries test eight quads at a time.
  struct ItemBounds {
    static constexpr std::size_t kPadding = 7;  // the last item is read with seven more
    std::vector<float> low_x, high_x, low_y, high_y, low_z, high_z;

    void reserve(std::size_t count);
    void push_back(const QuadBounds& bounds);
    /// Bit k of the result is set if the bounds of item first + k contain the position. Bits beyond the last item are
    /// undefined.
    uint32_t that_contain(std::size_t first, const Float8& x, const Float8& y, const Float8& z) const {
      const auto between = [&](const std::vector<float>& low, const Float8& value, const std::vector<float>& high) {
        return (load8(&low[first]) <= value) & (value <= load8(&high[first]));
      };
      return bits_of(between(low_x, x, high_x) & between(low_y, y, high_y) & between(low_z, z, high_z));
    }
  };

  /// Calls visit(index) for quads of a cell whose bounds contain a position, until a call returns true.
  template <typename Visit>
  bool any_in_cell(std::size_t cell, Vec2 p, double z_m, Visit&& visit) const {
    const GridView grid = grid_.view();
    const auto begin = static_cast<std::size_t>(grid.begin[cell]), end = static_cast<std::size_t>(grid.begin[cell + 1]);
    count_lookups(static_cast<int64_t>(end - begin));
    const Float8 x = p.x, y = p.y, z = static_cast<float>(z_m);
    for (std::size_t first = begin; first < end; first += 8) {
      uint32_t items = bounds_.that_contain(first, x, y, z);
      if (end - first < 8) items &= (1u << (end - first)) - 1;
      for (; items != 0; items &= items - 1) {
        if (visit(grid.items[first + static_cast<std::size_t>(std::countr_zero(items))])) return true;
      }
    }
    return false;
  }

  template <typename Visit>
  bool any_quad_at(const Eigen::Vector2d& p, double z, Visit&& visit) const {
    const GridView grid = grid_.view();
    const Vec2 position{static_cast<float>(p.x()), static_cast<float>(p.y())};
    if (!grid.contains(position)) return false;
    const std::size_t cell = static_cast<std::size_t>(grid.cell_y(position.y)) * static_cast<std::size_t>(grid.num_x) +
                             static_cast<std::size_t>(grid.cell_x(position.x));
    return any_in_cell(cell, position, z, [&](int32_t index) { return visit(quads_[index]); });
  }

  QuadBounds bounds_of(const Quad& quad) const;
  bool contains(const Quad& quad, const Eigen::Vector2d& p, double z) const {
    return !(std::abs(z - quad.mean_z_m) >= level_m_) && covers(quad, p);
  }
  static bool covers(const Quad& quad, const Eigen::Vector2d& p);
  void count_lookups(int64_t count) const {
    remaining_lookups_ -= count;
    if (remaining_lookups_ < 0) fail("too many overlapping lanes");
  }

  double level_m_ = 0;
  std::vector<Quad> quads_;
  std::vector<std::size_t> first_quads_;  // [bands]
  Grid grid_;
  ItemBounds bounds_;
  mutable int64_t remaining_lookups_ = 0;
};

}  // namespace pictura
