// Standing vehicles: waits at red lights, the distance moved during these waits, time in reverse, and vehicles that are
// stuck.
#include "pictura/evaluation/standing.h"

#include <gtest/gtest.h>

#include "pictura/backends/make_simulator.h"
#include "pictura/simulator/rules/limits.h"
#include "pictura/tests/simulator/test_maps.h"

namespace pictura {
namespace {

TEST(Standing, WaitsReversingAndStuckVehicles) {
  const auto map = testing::stadium(200, 1);
  testing::add_light(map.get(), 100, 4, 2, {0});
  const auto simulator =
      make_simulator("cpu", testing::cars({.reset_inactive_fraction = 2, .fixed_lights = true}), {map}, {{0, 3, 1}});
  // The first vehicle creeps towards the line, the second stands behind it, the third reverses on the other straight.
  const std::vector<int32_t> slots{0, 1, 2};
  std::vector<float> x_m{0, 80, 120}, y_m{0, 0, 40}, heading_rad{0, 0, kPi}, speed_mps{0.2f, 0, -0.5f};
  x_m[0] = 100 - 4.5f -
           (simulator->scene().agents[0].length_m * 0.5f +
            reference_to_center(AgentClass::vehicle, simulator->scene().agents[0].length_m));
  simulator->set_state(slots, std::vector<NamedArray>{{"x_m", Array(x_m)},
                                                      {"y_m", Array(y_m)},
                                                      {"heading_rad", Array(heading_rad)},
                                                      {"speed_mps", Array(speed_mps)}});
  StandingObserver observer(*simulator);
  constexpr int kSteps = 180;
  int waits = 0, red_steps_of_waits = 0;
  bool was_red = false;
  for (int step = 0; step < kSteps; ++step) {
    const std::vector<Command> commands(3);
    observer.after_step(simulator->step(Span<const Command>(commands)));
    const bool is_red = simulator->scene().light_states[0] == LightState::red;
    waits += is_red && !was_red;
    red_steps_of_waits += is_red && was_red;
    was_red = is_red;
  }
  ASSERT_GT(waits, 0);
  ASSERT_LT(red_steps_of_waits + waits, kSteps);
  for (int slot = 0; slot < 3; ++slot) ASSERT_EQ(simulator->state().status[slot], AgentStatus::active);
  StandingCounts counts = observer.counts().at(0);
  EXPECT_EQ(counts.driven_steps, 3 * kSteps);
  EXPECT_EQ(counts.reversing_steps, kSteps);
  EXPECT_EQ(counts.red_waits, waits);
  EXPECT_NEAR(counts.red_wait_moved_m, 0.02 * red_steps_of_waits, 1e-3);
  EXPECT_EQ(counts.stuck_at_end, 0) << "nobody has stood for 60 s yet";

  // Only the second vehicle is stuck: the others need 25 s and 10 s for 5 m.
  for (int step = kSteps; step < 620; ++step) {
    if (step % 200 == 0) simulator->set_state(slots, std::vector<NamedArray>{{"x_m", Array(x_m)}});
    const std::vector<Command> commands(3);
    observer.after_step(simulator->step(Span<const Command>(commands)));
  }
  for (int slot = 0; slot < 3; ++slot) ASSERT_EQ(simulator->state().status[slot], AgentStatus::active);
  EXPECT_EQ(observer.counts().at(0).stuck_at_end, 1);
}

}  // namespace
}  // namespace pictura
