// Builder of uniform grids over the ground plane (grid_view.h), on the host.
#pragma once

#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/common/grid_view.h"

namespace pictura {

class Grid {
 public:
  Grid() = default;
  /// Puts item i into every cell that boxes[i] touches. Throws Error if cell_m is not positive or a box is not finite.
  /// Also throws for more than 2^26 cells, or more than 2^27 items summed over the cells.
  Grid(Span<const Aabb2> boxes, float cell_m);
  GridView view() const { return {origin_m_, cell_m_, num_x_, num_y_, begin_, items_}; }
  std::size_t num_boxes() const { return num_boxes_; }

 private:
  Vec2 origin_m_;
  float cell_m_ = 1;
  int num_x_ = 0, num_y_ = 0;
  std::size_t num_boxes_ = 0;
  std::vector<int32_t> begin_;
  std::vector<int32_t> items_;
};

/// Number of cells that a box touches.
inline int64_t num_cells(const GridView& grid, const Aabb2& box) {
  const int64_t columns = grid.cell_x(box.high.x) - grid.cell_x(box.low.x) + 1;
  return columns * (grid.cell_y(box.high.y) - grid.cell_y(box.low.y) + 1);
}
/// Calls visit(cell) with the index of each cell that a box touches.
template <typename Visit>
void visit_cells(const GridView& grid, const Aabb2& box, Visit&& visit) {
  for (int y = grid.cell_y(box.low.y); y <= grid.cell_y(box.high.y); ++y) {
    for (int x = grid.cell_x(box.low.x); x <= grid.cell_x(box.high.x); ++x) {
      visit(static_cast<std::size_t>(y) * static_cast<std::size_t>(grid.num_x) + static_cast<std::size_t>(x));
    }
  }
}
/// Calls visit(item) for each item of each cell that a box touches.
template <typename Visit>
void visit_items(const GridView& grid, const Aabb2& box, Visit&& visit) {
  visit_cells(grid, box, [&](std::size_t cell) {
    for (int32_t i = grid.begin[cell]; i < grid.begin[cell + 1]; ++i) {
      visit(static_cast<std::size_t>(grid.items[i]));
    }
  });
}

}  // namespace pictura
