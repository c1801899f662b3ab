// Uniform grid over the ground plane, for host and CUDA code. It lists, for each square cell, the items that touch the
// cell. Grid (grid.h) owns the memory.
#pragma once

#include "pictura/common/math.h"
#include "pictura/common/span.h"

namespace pictura {

struct Aabb2 {
  Vec2 low, high;
};

/// The items of cell (ix, iy) are items[begin[c]] to items[begin[c + 1] - 1], ascending, where c = iy * num_x + ix.
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

}  // namespace pictura
