// The uniform grid against brute-force search.
#include "pictura/common/grid.h"

#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/common/error.h"
#include "pictura/common/rng.h"
#include "pictura/tests/support/error_message.h"

namespace pictura {
namespace {

TEST(Grid, EveryBoxIsInEveryCellThatItTouches) {
  RandomStream random({.seed = 3, .purpose = Purpose::town});
  std::vector<Aabb2> boxes;
  for (int i = 0; i < 200; ++i) {
    const Vec2 low{random.uniform(-100, 100), random.uniform(-40, 90)};
    boxes.push_back({low, low + Vec2{random.uniform(0, 30), random.uniform(0, 5)}});
  }
  const Grid grid(boxes, 7.0f);
  const GridView view = grid.view();
  for (int y = 0; y < view.num_y; ++y) {
    for (int x = 0; x < view.num_x; ++x) {
      const int cell = y * view.num_x + x;
      std::vector<int> found(view.items.begin() + view.begin[cell],
                             view.items.begin() + view.begin[static_cast<size_t>(cell) + 1]);
      std::vector<int> expected;
      for (int i = 0; i < 200; ++i) {
        const Aabb2& box = boxes[i];
        if (view.cell_x(box.low.x) <= x && x <= view.cell_x(box.high.x) && view.cell_y(box.low.y) <= y &&
            y <= view.cell_y(box.high.y)) {
          expected.push_back(i);
        }
      }
      ASSERT_EQ(found, expected);
    }
  }
}

TEST(Grid, IsEmptyWithoutBoxes) {
  const Grid grid(Span<const Aabb2>{}, 5.0f);
  EXPECT_EQ(grid.view().items.size(), 0u);
}

TEST(Grid, RejectsBoxesThatCannotBeIndexed) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<Aabb2> bad{{{0, 0}, {nan, 1}}};
  EXPECT_THROW(Grid(bad, 5.0f), Error);
  const std::vector<Aabb2> huge{{{0, 0}, {1e7f, 1e7f}}};
  EXPECT_THROW(Grid(huge, 1.0f), Error);
  EXPECT_THROW(Grid(huge, 0.0f), Error);
  // More entries than an int32 can count, in sufficiently few cells.
  const std::vector<Aabb2> many(100, {{0, 0}, {8000, 8000}});
  EXPECT_THAT(test::message_of([&] { Grid(many, 1.0f); }), ::testing::HasSubstr("100 items over 8000 x 8000 m"));
}

}  // namespace
}  // namespace pictura
