// A step allocates nothing: every allocation of this binary is counted, and those of one thread's steps are none.
#include <cstdlib>
#include <new>

#include <gtest/gtest.h>

#include "pictura/simulator/simulator.h"
#include "pictura/tests/simulator/test_maps.h"

namespace {

thread_local long allocations = 0;

void* counted(std::size_t size) noexcept {
  ++allocations;
  return std::malloc(size > 0 ? size : 1);
}

void* counted_or_throw(std::size_t size) {
  if (void* memory = counted(size)) return memory;
  throw std::bad_alloc();
}

}  // namespace

// All forms but those for extended alignment, which nothing here asks for.
void* operator new(std::size_t size) { return counted_or_throw(size); }
void* operator new[](std::size_t size) { return counted_or_throw(size); }
void* operator new(std::size_t size, const std::nothrow_t&) noexcept { return counted(size); }
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept { return counted(size); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }

namespace pictura {
namespace {

TEST(Allocation, StepsAllocateNothing) {
  auto map = testing::stadium(200, 2);
  testing::add_light(map.get(), 100, 8, 2, {0, 4});
  const SimulatorConfig config = testing::cars({.num_threads = 1, .episode_steps = 40});
  const auto simulator = make_simulator("cpu", config, {map}, draw_worlds(2, 60, 1, 30, 1));
  const long before_vector = allocations;
  const std::vector<int32_t> actions(60, 3 * kNumLatActions + 1);
  ASSERT_GT(allocations, before_vector) << "allocations are not counted";
  simulator->step(actions);
  const long before = allocations;
  // Through collisions, resets and new episodes.
  for (int i = 0; i < 100; ++i) simulator->step(actions);
  EXPECT_EQ(allocations, before);
  EXPECT_GT(simulator->totals().episodes, 0);
  EXPECT_GT(simulator->totals().collisions + simulator->totals().off_road, 0);
}

}  // namespace
}  // namespace pictura
