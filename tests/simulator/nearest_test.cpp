// Selection of the nearest of many items, compared with sorting all items.
#include "pictura/simulator/rules/fast/nearest.h"

#include <algorithm>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "pictura/common/rng.h"

namespace pictura {
namespace {

TEST(NearestOfOneThread, EqualsTheStartOfTheSortedItems) {
  RandomStream random({.seed = 3, .purpose = Purpose::town});
  constexpr int kCapacity = 10;
  for (int num_items = 0; num_items < 150; ++num_items) {
    std::vector<Vec2> places;
    std::vector<int32_t> items;
    std::vector<std::pair<float, int32_t>> sorted;
    const int32_t except = num_items / 2;
    for (int i = 0; i < num_items; ++i) {
      // Places lie on a coarse lattice, so that many are equally near. Items come in descending order.
      places.push_back({std::floor(random.uniform(-5, 5)), std::floor(random.uniform(-5, 5))});
      items.push_back(num_items - 1 - i);
      const float distance2 = dot(places.back(), places.back());
      if (items.back() != except && distance2 < 20.0f) sorted.emplace_back(distance2, items.back());
    }
    std::sort(sorted.begin(), sorted.end());
    NearestOfOneThread<kCapacity> together, one_by_one;
    together.offer_all(places.data(), items.data(), num_items, except, {}, 20.0f);
    together.settle();
    for (size_t i = 0; i < places.size(); ++i) {
      const float distance2 = dot(places[i], places[i]);
      one_by_one.add(items[i] != except && distance2 < 20.0f, distance2, items[i]);
    }
    one_by_one.settle();
    const int expected = std::min(kCapacity, static_cast<int>(sorted.size()));
    ASSERT_EQ(together.count(), expected) << num_items;
    ASSERT_EQ(one_by_one.count(), expected) << num_items;
    for (int i = 0; i < expected; ++i) {
      EXPECT_EQ(together.item(i), sorted[i].second) << num_items;
      EXPECT_EQ(one_by_one.item(i), sorted[i].second) << num_items;
    }
  }
}

}  // namespace
}  // namespace pictura
