// The two forms of Float8, in a register and in memory, give bitwise identical results.
#include <random>

#include <gtest/gtest.h>

#include "pictura/tests/common/portable/float8_results.h"

namespace pictura {
namespace {

TEST(Float8, HasTheSameBitsInARegisterAndInMemory) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> number(-4, 4);
  for (int round = 0; round < 200; ++round) {
    Float8Inputs in;
    for (float& a : in.a) a = number(random);
    for (int k = 0; k < 8; ++k) {
      in.b[k] = random() % 4 == 0 ? in.a[k] : number(random);
      in.integers[k] = static_cast<int32_t>(random() % 100);
      in.indices[k] = static_cast<int32_t>(random() % 8);
    }
    in.mask = random() % 256;
    ASSERT_EQ(results_of(in), results_in_memory(in)) << round;
  }
}

TEST(Float8, MasksTheFirstLanesOfAnyCount) {
  EXPECT_EQ(first_lanes_mask(-1), 0u);
  EXPECT_EQ(first_lanes_mask(0), 0u);
  EXPECT_EQ(first_lanes_mask(3), 0b111u);
  EXPECT_EQ(first_lanes_mask(8), 0xFFu);
  EXPECT_EQ(first_lanes_mask(40), 0xFFu);
}

}  // namespace
}  // namespace pictura
