// Surfaces as bands between two borders, and the question which of them cover a place.
#pragma once

#include <cstdint>
#include <vector>

#include "pictura/common/error.h"
#include "pictura/common/grid.h"
#include "pictura/map/polyline.h"

namespace pictura {

struct Point2 {
  double x = 0, y = 0;
};

/// A piece of surface between two borders of equally many points; going along them, left is on the left. Samples must
/// be fine enough that straight pieces between them count as the surface.
struct SurfaceBand {
  std::vector<Point3> left, right;
};

/// All quads of all bands in a grid. Bands more than `level_m` above or below a place do not cover it. Answers look at
/// a bounded number of quads in all, many times what roads need that cross and overlap as roads do; where bands without
/// end lie upon each other, any_band_at() throws Error instead of going on for hours.
class Surface {
 public:
  Surface(const std::vector<SurfaceBand>& bands, double level_m);

  /// Calls visit(band) for every band that covers `p` at about the height `z`, until it returns true; says whether one
  /// did.
  template <typename Visit>
  bool any_band_at(const Point2& p, double z, Visit&& visit) const {
    const GridView grid = grid_.view();
    const Vec2 place{static_cast<float>(p.x), static_cast<float>(p.y)};
    if (!grid.contains(place)) return false;
    const std::size_t cell = static_cast<std::size_t>(grid.cell_y(place.y)) * static_cast<std::size_t>(grid.num_x) +
                             static_cast<std::size_t>(grid.cell_x(place.x));
    spend(grid.begin[cell + 1] - grid.begin[cell]);
    for (int32_t i = grid.begin[cell]; i < grid.begin[cell + 1]; ++i) {
      const Quad& quad = quads_[static_cast<std::size_t>(grid.items[static_cast<std::size_t>(i)])];
      if (contains(quad, p, z) && visit(quad.band)) return true;
    }
    return false;
  }

 private:
  struct Quad {
    Point3 corners[4];  // counter-clockwise: left, right, next right, next left
    int32_t band = 0;
  };

  bool contains(const Quad& quad, const Point2& p, double z) const;
  void spend(int64_t looks) const {
    looks_left_ -= looks;
    if (looks_left_ < 0) fail("too many lanes lie upon each other");
  }

  double level_m_ = 0;
  std::vector<Quad> quads_;
  Grid grid_;
  mutable int64_t looks_left_ = 0;
};

}  // namespace pictura
