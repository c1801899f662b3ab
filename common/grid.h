// A uniform grid over the ground plane in compressed rows: which items touch which square cell. Built on the host, read
// on both devices.
#pragma once

#include <vector>

#include "pictura/common/math.h"
#include "pictura/common/span.h"

namespace pictura {

struct Aabb2 {
  Vec2 low, high;
};

/// What both devices read. Items of cell (ix, iy) are items[begin[c]] .. items[begin[c + 1] - 1], c = iy * num_x + ix,
/// in ascending order of item.
struct GridView {
  Vec2 origin_m;
  float cell_m = 1;
  int num_x = 0, num_y = 0;
  Span<const int32_t> begin;  // [num_x * num_y + 1]
  Span<const int32_t> items;  // [begin.back()]

  PICTURA_HD int cell_x(float x_m) const {
    return clamp(static_cast<int>(floorf((x_m - origin_m.x) / cell_m)), 0, num_x - 1);
  }
  PICTURA_HD int cell_y(float y_m) const {
    return clamp(static_cast<int>(floorf((y_m - origin_m.y) / cell_m)), 0, num_y - 1);
  }
  PICTURA_HD bool contains(Vec2 p) const {
    return p.x >= origin_m.x && p.y >= origin_m.y && p.x < origin_m.x + cell_m * static_cast<float>(num_x) &&
           p.y < origin_m.y + cell_m * static_cast<float>(num_y);
  }
};

class Grid {
 public:
  Grid() = default;
  /// Puts item i into every cell that boxes[i] touches. Throws on a non-finite box, or when the area over the cell size
  /// would need more than 2^26 cells.
  Grid(Span<const Aabb2> boxes, float cell_m);
  GridView view() const { return {origin_m_, cell_m_, num_x_, num_y_, begin_, items_}; }

 private:
  Vec2 origin_m_;
  float cell_m_ = 1;
  int num_x_ = 0, num_y_ = 0;
  std::vector<int32_t> begin_;
  std::vector<int32_t> items_;
};

}  // namespace pictura
