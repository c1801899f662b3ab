// Simulator::set_state() for chosen agents, and reset of chosen worlds.
#include <cmath>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/backends/make_controller.h"
#include "pictura/backends/make_simulator.h"
#include "pictura/map/load_map.h"
#include "pictura/simulator/agent_state_arrays.h"
#include "pictura/simulator/rules/observe.h"
#include "pictura/tests/simulator/cpu_simulator.h"
#include "pictura/tests/simulator/random_edit.h"
#include "pictura/tests/simulator/same_bits.h"
#include "pictura/tests/simulator/test_maps.h"
#include "pictura/tests/support/error_message.h"

namespace pictura {
namespace {

using ::testing::HasSubstr;
using testing::run;

std::unique_ptr<Simulator> make(const SimulatorConfig& config, std::vector<WorldSpec> worlds) {
  return testing::make(config, testing::stadium(200, 2), std::move(worlds));
}

NamedArray named(std::string_view name, const auto& values) { return {name, Array(values)}; }

TEST(ResetOfWorlds, StartsChosenWorldsFromTheSeedAndKeepsOthers) {
  const std::vector<WorldSpec> worlds{{0, 12, 0}, {0, 9, 1}, {0, 12, 2}};
  const auto simulator = make(testing::cars({.seed = 3, .episode_steps = 30}), worlds);
  const auto untouched = make(testing::cars({.seed = 3, .episode_steps = 30}), worlds);
  const auto other_seed = make(testing::cars({.seed = 8, .episode_steps = 30}), worlds);
  run(simulator.get(), 40);
  run(untouched.get(), 40);
  simulator->reset(std::vector<uint8_t>{0, 1, 0}, 8);
  for (int steps = 0; steps < 70; ++steps) {
    for (int slot = 0; slot < simulator->num_slots(); ++slot) {
      const bool is_reset = slot >= 12 && slot < 21;
      const Simulator& expected = is_reset ? *other_seed : *untouched;
      const AgentStateView a = simulator->state(), b = const_cast<Simulator&>(expected).state();
#define X(name, type, per_agent, first, comment)                                                                  \
  ASSERT_EQ(std::memcmp(a.name + slot * (per_agent), b.name + slot * (per_agent), sizeof(type) * (per_agent)), 0) \
      << #name << " of slot " << slot << " after " << steps;
      PICTURA_AGENT_FIELDS(X)
#undef X
      const size_t ego = static_cast<size_t>(slot) * kEgoFeatures;
      ASSERT_TRUE(testing::same_bits(simulator->observations().ego.subspan(ego, kEgoFeatures),
                                     const_cast<Simulator&>(expected).observations().ego.subspan(ego, kEgoFeatures)));
    }
    for (Simulator* each : {simulator.get(), untouched.get(), other_seed.get()}) run(each, 1, 40 + steps);
  }
}

TEST(ResetOfWorlds, IsSavedAndUndoneByAResetOfAll) {
  const auto simulator = make(testing::cars({.episode_steps = 20}), {{0, 12, 0}, {0, 12, 1}});
  const uint64_t first = simulator->state_hash();
  simulator->reset(std::vector<uint8_t>{1, 1}, 5);
  EXPECT_NE(simulator->state_hash(), first);
  const auto copy = make(testing::cars({.episode_steps = 20}), {{0, 12, 0}, {0, 12, 1}});
  copy->restore(simulator->save());
  run(simulator.get(), 50);
  run(copy.get(), 50);
  EXPECT_EQ(simulator->save(), copy->save()) << "later episodes are of the seed, too";
  simulator->reset();
  EXPECT_EQ(simulator->state_hash(), first);
}

TEST(ResetOfWorlds, WorksWithTheLaneKeeper) {
  const auto simulator = make_simulator("cpu", {.pedestrian_fraction = 0}, {load_map("procedural:1")}, {{0, 6, 0}});
  const auto lane = make_controller("lane", *simulator, 0);
  std::vector<Command> commands(6);
  const auto drive = [&] {
    lane->act(simulator->arrays(), {}, commands);
    simulator->step(commands);
  };
  drive();
  simulator->reset(std::vector<uint8_t>{1}, 77);
  for (int step = 0; step < 30; ++step) drive();
  EXPECT_GT(simulator->totals().distance_m, 10);
}

TEST(ResetOfWorlds, ClearsResultsAndRefusesMasksOfAnotherSize) {
  const auto simulator = make(testing::cars(), {{0, 12, 0}, {0, 12, 1}});
  const StepResult result = simulator->step(std::vector<int32_t>(24, kIdleAction));
  ASSERT_EQ(result.valid[3], 1);
  simulator->reset(std::vector<uint8_t>{1, 0}, 5);
  EXPECT_EQ(result.valid[3], 0);
  EXPECT_EQ(result.valid[15], 1);
  EXPECT_EQ(simulator->episode_step()[0], 0);
  EXPECT_EQ(simulator->episode_step()[1], 1);
  EXPECT_EQ(simulator->episode_over()[0], 0);
  EXPECT_EQ(test::message_of([&] { simulator->reset(std::vector<uint8_t>{1}, 5); }),
            "reset: world_mask: expected u8 [2] on cpu, got u8 [1] on cpu");
}

TEST(SetState, MovesAgentsAndUpdatesDerivedState) {
  const auto simulator = make(testing::cars(), {{0, 4, 0}, {0, 3, 1}});
  run(simulator.get(), 5);
  const uint64_t reward_bits = simulator->state_hash();
  const std::vector<int32_t> slots{5, 1};
  const std::vector<float> x_m{60, 80}, y_m{0.5f, 4}, heading_rad{0.25f + 2 * kPi, -0.1f}, speed_mps{7, 3};
  simulator->set_state(slots,
                       std::vector<NamedArray>{named("x_m", x_m), named("y_m", y_m), named("heading_rad", heading_rad),
                                               named("speed_mps", speed_mps)});
  EXPECT_NE(simulator->state_hash(), reward_bits);
  const AgentStateView state = simulator->state();
  EXPECT_FLOAT_EQ(state.heading_rad[5], 0.25f) << "wrapped";
  EXPECT_FLOAT_EQ(state.cos_heading[5], std::cos(0.25f));
  EXPECT_FLOAT_EQ(state.lane_offset_m[5], 0.5f) << "lane 0 is at y = 0";
  EXPECT_NEAR(state.lane_angle_rad[5], 0.25f, 1e-6f);
  EXPECT_FLOAT_EQ(state.lane_offset_m[1], 0) << "lane 1 is at y = 4";
  EXPECT_NE(state.lane[1], state.lane[5]);
  EXPECT_EQ(simulator->views()[5].origin_m.x, 60);
  EXPECT_EQ(simulator->views()[1].origin_m.y, 4);
  const SceneBatch& scene = simulator->scene();
  const AgentBox& box = scene.agents[scene.world_begin[1] + 1];
  EXPECT_FLOAT_EQ(box.center_m.x, 60 + 0.5f * kWheelbasePerLength * state.length_m[5] * std::cos(0.25f));
  EXPECT_FLOAT_EQ(simulator->observations().ego[5 * kEgoFeatures] * kScaleSpeed_mps, 7) << "speed, by its scale";
}

TEST(SetState, KeepsOtherAgentsAndUpdatesTheirObservations) {
  const auto simulator = make(testing::cars(), {{0, 2, 0}});
  const std::vector<int32_t> both{0, 1}, second{1};
  const std::vector<float> x_m{50, 62}, y_m{0, 0}, zeros{0, 0};
  simulator->set_state(both,
                       std::vector<NamedArray>{named("x_m", x_m), named("y_m", y_m), named("heading_rad", zeros)});
  const float ahead_m = simulator->observations().partners[0] * kScalePosition_m;
  const float behind_by_m = 0.5f * kWheelbasePerLength * simulator->state().length_m[1];
  EXPECT_NEAR(ahead_m, 12 + behind_by_m, 1e-3f);
  const std::vector<float> farther{70};
  simulator->set_state(second, std::vector<NamedArray>{named("x_m", farther)});
  EXPECT_NEAR(simulator->observations().partners[0] * kScalePosition_m, ahead_m + 8, 1e-3f);
  EXPECT_EQ(simulator->state().x_m[0], 50);
  EXPECT_EQ(simulator->step(std::vector<int32_t>{kIdleAction, kIdleAction}).terminated[1], 0)
      << "nobody is met on the way to where an agent was put";
}

TEST(SetState, OverlappingPosesCollideInTheNextStep) {
  const auto simulator = make(testing::cars({.reset_inactive_fraction = 2}), {{0, 2, 0}});
  const std::vector<int32_t> both{0, 1};
  const std::vector<float> x_m{50, 52}, zeros{0, 0};
  simulator->set_state(both,
                       std::vector<NamedArray>{named("x_m", x_m), named("y_m", zeros), named("heading_rad", zeros)});
  const StepResult result = simulator->step(std::vector<int32_t>{kIdleAction, kIdleAction});
  EXPECT_EQ(result.terminated[0], 1);
  EXPECT_EQ(result.terminated[1], 1);
  EXPECT_EQ(simulator->totals().collisions, 2);
  // Agents can become active again.
  const std::vector<float> apart{50, 90};
  const std::vector<uint8_t> active{0, 0};
  simulator->set_state(both, std::vector<NamedArray>{named("x_m", apart), named("status", active)});
  EXPECT_EQ(simulator->state().halt_reason[0], 0);
  EXPECT_EQ(simulator->step(std::vector<int32_t>{kIdleAction, kIdleAction}).valid[0], 1);
}

TEST(SetState, CountsAnUnplacedAgentAsSpawned) {
  const auto simulator = make_simulator("cpu", testing::cars(), {testing::ring_road(40)}, {{0, 300, 0}});
  const SpawnReport before = simulator->spawn_report();
  ASSERT_GT(before.refused, 0);
  int32_t absent = 0;
  while (simulator->state().refusal[absent] == SpawnFailure::none) ++absent;
  const std::vector<int32_t> slots{absent}, goal_lane{0};
  const std::vector<uint8_t> active{0};
  EXPECT_EQ(test::message_of([&] { simulator->set_state(slots, std::vector<NamedArray>{named("status", active)}); }),
            fmt::format("set_state: slot {}: goal_lane: expected a lane of the map, or for pedestrians a piece of a "
                        "walkway, unless the agent is absent",
                        absent));
  simulator->set_state(slots, std::vector<NamedArray>{named("status", active), named("goal_lane", goal_lane)});
  const SpawnReport after = simulator->spawn_report();
  EXPECT_EQ(after.spawned, before.spawned + 1);
  EXPECT_EQ(after.refused, before.refused - 1);
  EXPECT_EQ(after.asked, after.spawned + after.refused);
}

TEST(SetState, ContinuesAsARestoredSimulatorDoes) {
  const auto simulator = make(testing::cars({.episode_steps = 40}), draw_worlds(2, 60, 1, 40, 1));
  const auto copy = make(testing::cars({.episode_steps = 40}), draw_worlds(2, 60, 1, 40, 1));
  for (uint32_t round = 0; round < 6; ++round) {
    const testing::RandomEdit edit(simulator->state(), simulator->num_slots(), round);
    simulator->set_state(edit.slots(), edit.fields());
    copy->restore(simulator->save());
    EXPECT_EQ(testing::first_difference(simulator->observations(), copy->observations()), "") << round;
    EXPECT_TRUE(testing::same_bits(simulator->views(), copy->views()));
    run(simulator.get(), 15, 15 * round);
    run(copy.get(), 15, 15 * round);
    ASSERT_EQ(simulator->save(), copy->save()) << round;
  }
}

TEST(SetState, RefusesInvalidStatesAndChangesNothing) {
  const auto simulator = make(testing::cars(), {{0, 4, 0}});
  const std::vector<uint8_t> before = simulator->save();
  const auto refusal = [&](const std::vector<int32_t>& slots, const std::vector<NamedArray>& fields) {
    const std::string message = test::message_of([&] { simulator->set_state(slots, fields); });
    EXPECT_EQ(simulator->save(), before);
    return message;
  };
  const std::vector<float> one{1}, two{1, 2}, not_a_number{NAN}, far{2e6f}, long_m{9}, nothing_m{0}, turns{1e4f};
  const std::vector<int32_t> number{3};
  const std::vector<double> wide{1};
  const std::vector<uint8_t> byte{3};
  EXPECT_EQ(refusal({4}, {named("x_m", one)}), "set_state: slots: element 0: expected a slot in [0, 4), got 4");
  EXPECT_EQ(refusal({0, -1}, {named("x_m", two)}), "set_state: slots: element 1: expected a slot in [0, 4), got -1");
  EXPECT_EQ(refusal({2, 2}, {named("x_m", two)}), "set_state: slots: element 1: expected each slot once, got 2 again");
  EXPECT_EQ(refusal({2}, {named("x_m", not_a_number)}), "set_state: slot 2: x_m: the value is out of range");
  EXPECT_EQ(refusal({2}, {named("y_m", far)}), "set_state: slot 2: y_m: the value is out of range");
  EXPECT_EQ(refusal({2}, {named("heading_rad", turns)}), "set_state: slot 2: heading_rad: the value is out of range");
  EXPECT_EQ(refusal({2}, {named("length_m", long_m)}), "set_state: slot 2: length_m: the value is out of range");
  for (const char* size : {"length_m", "width_m"}) {
    EXPECT_EQ(refusal({2}, {named(size, nothing_m)}),
              std::string("set_state: slot 2: ") + size + ": the value is out of range");
  }
  EXPECT_EQ(refusal({2}, {named("next_waypoint", number)}),
            "set_state: slot 2: next_waypoint: the value is out of range");
  EXPECT_EQ(refusal({2}, {named("agent_class", byte)}), "set_state: slot 2: agent_class: the value is out of range");
  EXPECT_EQ(refusal({2}, {named("x_m", two)}),
            "set_state: x_m: expected f32 [1] on cpu, got f32 [2] on cpu, read-only");
  EXPECT_EQ(refusal({2}, {named("x_m", wide)}),
            "set_state: x_m: expected f32 [1] on cpu, got f64 [1] on cpu, read-only");
  EXPECT_EQ(refusal({2}, {named("x_m", one), named("x_m", one)}), "set_state: x_m: expected each field once");
  EXPECT_EQ(refusal({2}, {named("lane", number)}), "set_state: lane: follows from other fields and cannot be set");
  EXPECT_EQ(refusal({2}, {named("sped_mps", one)}),
            "set_state: expected names of an agent's fields, got 'sped_mps'; did you mean 'speed_mps'?");
  EXPECT_THAT(refusal({0, 1, 2, 3, 0}, {}), HasSubstr("at most 4"));
}

TEST(AgentStateArrays, HaveEveryFieldWithNameTypeAndShape) {
  const auto simulator = make(testing::cars(), {{0, 4, 0}});
  const std::vector<NamedArray> arrays = agent_state_arrays(simulator->state(), 4, simulator->device());
  ASSERT_EQ(arrays.size(), std::size(kAgentFields));
  for (size_t i = 0; i < arrays.size(); ++i) {
    EXPECT_EQ(arrays[i].name, kAgentFields[i].name);
    EXPECT_EQ(arrays[i].array.type, kAgentFields[i].type);
    const int per_agent = kAgentFields[i].per_agent;
    EXPECT_EQ(arrays[i].array.shape, per_agent == 1 ? Dims{4} : (Dims{4, per_agent}));
  }
  EXPECT_EQ(arrays[0].array.data, simulator->state().x_m);
}

}  // namespace
}  // namespace pictura
