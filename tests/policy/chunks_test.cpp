#include "pictura/policy/chunks.h"

#include <gtest/gtest.h>

namespace pictura {
namespace {

TEST(Chunks, HaveOneAllowedSize) {
  EXPECT_EQ(chunk_size(1000, {2048}, /*on_device=*/false), 1000);
  EXPECT_EQ(chunk_size(1000, {600}, false), 500);
  EXPECT_EQ(chunk_size(1001, {250}, false), 201);
  EXPECT_EQ(chunk_size(1, {1}, false), 1);
}

TEST(Chunks, AreMultiplesOfAGranuleOnADevice) {
  EXPECT_EQ(chunk_size(1000, {2048}, /*on_device=*/true), 1024);
  EXPECT_EQ(chunk_size(17'000, {65'536}, true), 17'152);
  // Full chunks, for any much larger batch.
  for (int64_t count = 14'337; count < 70'000; count += 119) EXPECT_EQ(chunk_size(count, {2048}, true), 2048) << count;
  // The maximum size is never exceeded.
  EXPECT_EQ(chunk_size(520, {260}, true), 260);
  EXPECT_EQ(chunk_size(64, {64}, true), 64);
}

TEST(Chunks, FullChunksHaveTheLargestSize) {
  for (const bool on_device : {false, true}) {
    for (const int64_t count : {1, 599, 600, 601, 5000}) EXPECT_EQ(chunk_size(count, {600, true}, on_device), 600);
  }
}

TEST(Chunks, HoldEachRowOnceAndFillTheLastUpWithTheFirst) {
  for (const int64_t total : {1, 7, 12, 100}) {
    const at::Tensor batch = at::arange(total) + 1000;
    std::vector<int64_t> seen;
    for_each_chunk(batch, {6}, [&](const Chunk& chunk) {
      EXPECT_EQ(chunk.begin, static_cast<int64_t>(seen.size()));
      EXPECT_EQ(chunk.size(), chunk_size(total, {6}, false));
      const at::Tensor numbers = chunk.take(batch);
      for (int64_t i = 0; i < chunk.size(); ++i) {
        const int64_t row = chunk.rows[i].item<int64_t>();
        if (i < chunk.count) {
          seen.push_back(row);
          EXPECT_EQ(numbers[i].item<int64_t>(), row);
        } else {
          EXPECT_EQ(row, 1000);
          EXPECT_EQ(numbers[i].item<int64_t>(), 0);
        }
      }
    });
    ASSERT_EQ(static_cast<int64_t>(seen.size()), total);
    for (int64_t i = 0; i < total; ++i) EXPECT_EQ(seen[i], 1000 + i);
  }
}

TEST(Chunks, AnEmptyBatchHasNone) {
  for_each_chunk(at::empty({0}, at::kLong), {6}, [](const Chunk&) { ADD_FAILURE(); });
}

}  // namespace
}  // namespace pictura
