// Grid index of boxes that are added to a world one by one.
#pragma once

#include "pictura/common/cells_around.h"
#include "pictura/common/scene_types.h"

namespace pictura {

/// A linked list ("chain") of boxes per cell. A box belongs to the cell of its centre. The last added box comes first;
/// -1 ends a chain.
struct BoxChains {
  GridView cells;            // without item lists
  int32_t* first = nullptr;  // [cells] first box of each chain
  int32_t* next = nullptr;   // [boxes] next box of the chain

  PICTURA_HD int num_cells() const { return cells.num_x * cells.num_y; }
  PICTURA_HD int32_t* first_at(Vec2 p) const { return first + cells.cell_y(p.y) * cells.num_x + cells.cell_x(p.x); }
};

/// Returns at most num_boxes cells, each with a side of at least min_cell_m.
PICTURA_HD inline GridView chain_cells(Vec2 low_m, Vec2 high_m, int num_boxes, float min_cell_m) {
  const float extent_m = max_of(max_of(high_m.x - low_m.x, high_m.y - low_m.y), min_cell_m);
  int side = 1;
  while ((side + 1) * (side + 1) <= num_boxes && min_cell_m * static_cast<float>(side + 1) <= extent_m) ++side;
  return {low_m, extent_m / static_cast<float>(side), side, side, {}, {}};
}

/// exchange(pointer, value) must store the value and return the previous value, atomically if several threads add
/// boxes.
template <typename Exchange>
PICTURA_HD void add_box(const BoxChains& chains, int32_t box, Vec2 center_m, const Exchange& exchange) {
  chains.next[box] = exchange(chains.first_at(center_m), box);
}

/// Whether test(box) holds for any box within reach_m of p. May also test farther boxes.
template <typename ThreadGroup, typename Test>
PICTURA_HD bool any_box_near(const BoxChains& chains, Vec2 p, float reach_m, const ThreadGroup& group,
                             const Test& test) {
  constexpr float kLeeway_m = 0.1f;  // exceeds rounding errors
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
