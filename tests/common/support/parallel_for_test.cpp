// parallel_for visits every item once and rethrows the lowest item's exception.
#include "pictura/common/support/parallel_for.h"

#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace pictura {
namespace {

TEST(ParallelFor, VisitsEveryItemOnce) {
  for (const int threads : {0, 1, 3}) {
    std::vector<int> visits(1000, 0);
    parallel_for(threads, 1000, [&](std::int64_t i) { ++visits[static_cast<std::size_t>(i)]; });
    EXPECT_EQ(visits, std::vector<int>(1000, 1));
  }
}

TEST(ParallelFor, RethrowsTheLowestItemsException) {
  try {
    parallel_for(3, 100, [](std::int64_t i) {
      if (i >= 40) throw std::runtime_error(std::to_string(i));
    });
    FAIL() << "expected an exception";
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "40");
  }
}

}  // namespace
}  // namespace pictura
