// Steps on one thread allocate no memory. The test counts all allocations of this program.
#include <gtest/gtest.h>

#include "pictura/backends/make_simulator.h"
#include "pictura/simulator/simulator.h"
#include "pictura/tests/simulator/test_maps.h"
#include "pictura/tests/support/allocations.h"

namespace pictura {
namespace {

TEST(Allocation, StepsAllocateNothing) {
  auto map = testing::stadium(200, 2);
  testing::add_light(map.get(), 100, 8, 2, {0, 4});
  const SimulatorConfig config = testing::cars({.num_threads = 1, .episode_steps = 40});
  const auto simulator = make_simulator("cpu", config, {map}, draw_worlds(2, 60, 1, 30, 1));
  const long before_vector = test::allocations();
  const std::vector<int32_t> actions(60, 3 * kNumLatActions + 1);
  ASSERT_GT(test::allocations(), before_vector) << "allocations are not counted";
  simulator->step(actions);
  const long before = test::allocations();
  // Through collisions, resets and new episodes.
  for (int i = 0; i < 100; ++i) simulator->step(actions);
  EXPECT_EQ(test::allocations(), before);
  EXPECT_GT(simulator->totals().episodes, 0);
  EXPECT_GT(simulator->totals().collisions + simulator->totals().off_road, 0);
}

}  // namespace
}  // namespace pictura
