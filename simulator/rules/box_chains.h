// Index of the boxes that are added to a world one by one: a linked list ("chain") of boxes for each cell of a grid. It
// finds boxes near a place without a search of all boxes. The code runs on hosts and GPUs.
#pragma once

#include "pictura/common/cells_around.h"
#include "pictura/common/scene_types.h"

namespace pictura {

/// A chain of boxes per cell. A box belongs to the cell of its centre. A chain starts with the box that was added last;
/// -1 ends it.
struct BoxChains {
  GridView cells;            // origin, size and number of the cells; item lists are unused
  int32_t* first = nullptr;  // [cells.num_x * cells.num_y] first box of each chain
  int32_t* next = nullptr;   // [boxes] the next box of the same chain

  PICTURA_HD int num_cells() const { return cells.num_x * cells.num_y; }
  PICTURA_HD int32_t* first_at(Vec2 p) const { return first + cells.cell_y(p.y) * cells.num_x + cells.cell_x(p.x); }
};

/// Returns cells for the chains of num_boxes boxes in a rectangle. Cells have a side of at least min_cell_m; there are
/// at most as many cells as boxes.
PICTURA_HD inline GridView chain_cells(Vec2 low_m, Vec2 high_m, int num_boxes, float min_cell_m) {
  const float extent_m = max_of(max_of(high_m.x - low_m.x, high_m.y - low_m.y), min_cell_m);
  int side = 1;
  while ((side + 1) * (side + 1) <= num_boxes && min_cell_m * static_cast<float>(side + 1) <= extent_m) ++side;
  return {low_m, extent_m / static_cast<float>(side), side, side, {}, {}};
}

/// Adds a box to the chain of its centre's cell. exchange(pointer, value) must store the value at the pointer and
/// return the previous value. It must be atomic if several threads add boxes concurrently.
template <typename Exchange>
PICTURA_HD void add_box(const BoxChains& chains, int32_t box, Vec2 center_m, const Exchange& exchange) {
  chains.next[box] = exchange(chains.first_at(center_m), box);
}

/// Whether test(box) holds for any box whose centre is within reach_m of p. It may test farther boxes too. Each thread
/// of the group searches a part of the cells.
template <typename ThreadGroup, typename Test>
PICTURA_HD bool any_box_near(const BoxChains& chains, Vec2 p, float reach_m, const ThreadGroup& group,
                             const Test& test) {
  constexpr float kLeeway_m = 0.1f;  // exceeds the rounding errors of coordinate sums
  const CellRows range = cells_around(chains.cells, p, reach_m + kLeeway_m);
  const int columns = range.x1 - range.x0 + 1, count = columns * (range.y1 - range.y0 + 1);
  bool found = false;
  for (int k = group.rank(); k < count && !found; k += group.size()) {
    const int cell = (range.y0 + k / columns) * chains.cells.num_x + range.x0 + k % columns;
    for (int32_t box = chains.first[cell]; box >= 0 && !found; box = chains.next[box]) found = test(box);
  }
  return group.any(found);
}

}  // namespace pictura
