// Search for pieces in sight, eight at a time, compared with a test of each piece.
#include "pictura/simulator/rules/fast/pieces_in_sight.h"

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "pictura/common/rng.h"

namespace pictura {
namespace {

TEST(PiecesInSight, MatchIndividualVisibilityTests) {
  RandomStream random({.seed = 8, .purpose = Purpose::town});
  std::vector<ObservedPiece> pieces(200);
  std::vector<Vec2> middles;
  for (ObservedPiece& piece : pieces) {
    piece.middle_m = {random.uniform(-150, 150), random.uniform(-150, 150), 0};
    middles.push_back(piece.middle_m.xy());
  }
  int num_found = 0;
  for (int num_items = 0; num_items < 120; ++num_items) {
    const float heading_rad = random.uniform(-kPi, kPi);
    const EgoFrame frame{{random.uniform(-50, 50), random.uniform(-50, 50), 0},
                         {cos_of(heading_rad), sin_of(heading_rad)}};
    std::vector<int32_t> items, in_sight;
    for (int i = 0; i < num_items; ++i) items.push_back(static_cast<int32_t>(random.below(200)));
    for (const int32_t item : items) {
      if (is_in_sight(pieces[item], frame)) in_sight.push_back(item);
    }
    num_found += static_cast<int>(in_sight.size());
    for (const int capacity : {1, 5, 200}) {
      std::vector<int32_t> found(capacity + kFoundBeyond);
      const int count = find_pieces_in_sight(middles, items, frame, capacity, found.data());
      const int expected = std::min(capacity, static_cast<int>(in_sight.size()));
      ASSERT_GE(count, expected) << num_items;
      ASSERT_LE(count, static_cast<int>(in_sight.size())) << num_items;
      EXPECT_TRUE(std::equal(in_sight.begin(), in_sight.begin() + expected, found.begin())) << num_items;
    }
  }
  EXPECT_GT(num_found, 300);
}

}  // namespace
}  // namespace pictura
