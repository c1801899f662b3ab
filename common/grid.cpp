#include "pictura/common/grid.h"

#include <cmath>

#include "pictura/common/error.h"

namespace pictura {

Grid::Grid(Span<const Aabb2> boxes, float cell_m) : cell_m_(cell_m), num_boxes_(boxes.size()) {
  PICTURA_CHECK(cell_m > 0, "grid: expected a positive cell size, got {}", cell_m);
  Vec2 low{0, 0}, high{0, 0};
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const Aabb2& box = boxes[i];
    for (const float value : {box.low.x, box.low.y, box.high.x, box.high.y}) {
      PICTURA_CHECK(std::isfinite(value), "grid: item {}: expected finite coordinates, got {}", i, value);
    }
    low = i == 0 ? box.low : Vec2{min_of(low.x, box.low.x), min_of(low.y, box.low.y)};
    high = i == 0 ? box.high : Vec2{max_of(high.x, box.high.x), max_of(high.y, box.high.y)};
  }
  origin_m_ = low;
  const double cells_x = std::floor((static_cast<double>(high.x) - low.x) / cell_m) + 1;
  const double cells_y = std::floor((static_cast<double>(high.y) - low.y) / cell_m) + 1;
  PICTURA_CHECK(cells_x * cells_y <= double{1 << 26}, "grid: an area of {} x {} m is too large for cells of {} m",
                high.x - low.x, high.y - low.y, cell_m);
  num_x_ = static_cast<int>(cells_x);
  num_y_ = static_cast<int>(cells_y);

  const GridView grid = view();
  constexpr int64_t kMaxEntries = int64_t{1} << 27;  // half a gigabyte
  int64_t num_entries = 0;
  for (const Aabb2& box : boxes) num_entries += num_cells(grid, box);
  PICTURA_CHECK(num_entries <= kMaxEntries,
                "grid: {} items over {} x {} m lie in {} cells of {} m, expected at most {}", boxes.size(),
                high.x - low.x, high.y - low.y, num_entries, cell_m, kMaxEntries);

  // Counting sort: count the items of each cell, compute the start of each cell's range, then store the items in order.
  begin_.assign(static_cast<std::size_t>(num_x_) * static_cast<std::size_t>(num_y_) + 1, 0);
  for (const Aabb2& box : boxes) visit_cells(grid, box, [&](std::size_t cell) { ++begin_[cell + 1]; });
  for (std::size_t cell = 1; cell < begin_.size(); ++cell) begin_[cell] += begin_[cell - 1];
  items_.resize(begin_.back());
  std::vector<int32_t> next(begin_.begin(), begin_.end() - 1);
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    visit_cells(grid, boxes[i], [&](std::size_t cell) { items_[next[cell]++] = static_cast<int32_t>(i); });
  }
}

}  // namespace pictura
