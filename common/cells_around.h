// Cells of a grid near a point, for host and CUDA code.
#pragma once

#include "pictura/common/grid_view.h"

namespace pictura {

/// A rectangle of cells. In the grid's list, the items of cell row y are contiguous: [begin(cells, y), end(cells, y)).
struct CellRows {
  int x0 = 0, x1 = 0, y0 = 0, y1 = 0;
  PICTURA_HD int32_t begin(const GridView& cells, int y) const { return cells.begin[y * cells.num_x + x0]; }
  PICTURA_HD int32_t end(const GridView& cells, int y) const { return cells.begin[y * cells.num_x + x1 + 1]; }
};

/// Returns the cells that the square of half-width reach_m about p touches.
PICTURA_HD inline CellRows cells_around(const GridView& cells, Vec2 p, float reach_m) {
  if (cells.num_x == 1 && cells.num_y == 1) return {};  // avoids the divisions
  return {cells.cell_x(p.x - reach_m), cells.cell_x(p.x + reach_m), cells.cell_y(p.y - reach_m),
          cells.cell_y(p.y + reach_m)};
}

}  // namespace pictura
