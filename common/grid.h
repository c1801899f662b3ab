// A uniform grid over the ground plane in compressed rows: which items touch which square cell. Built on the host, read
// on both devices.
#pragma once

#include <vector>

#include "pictura/common/grid_view.h"

namespace pictura {

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
