// The CUDA simulator's phases, run on the host in random orders, give the bits of the CPU simulator.
#include <cstring>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/backends/make_simulator.h"
#include "pictura/map/load_map.h"
#include "pictura/map/opendrive/opendrive.h"
#include "pictura/simulator/agent_state_arrays.h"
#include "pictura/simulator/recorded_scene.h"
#include "pictura/tests/backend_cuda/simulator/shuffled_executor.h"
#include "pictura/tests/map/open_roads.h"
#include "pictura/tests/simulator/random_edit.h"
#include "pictura/tests/simulator/random_queries.h"
#include "pictura/tests/simulator/same_bits.h"
#include "pictura/tests/simulator/test_maps.h"
#include "pictura/tests/support/recorded_crossing.h"

namespace pictura {
namespace {

/// Steps both executors with the same actions, or commands of all kinds, and compares all public outputs. In worlds of
/// recorded scenes most commands of all kinds follow the record.
void expect_same(const SimulatorConfig& config, const CompiledMaps& maps, const std::vector<WorldSpec>& worlds,
                 int steps, unsigned shuffle_seed, bool by_commands = false) {
  const auto cpu = make_simulator("cpu", config, maps, worlds);
  testing::ShuffledExecutor other(config, maps, worlds, shuffle_seed);
  for (int step = 0; step <= steps; ++step) {
    ASSERT_EQ(cpu->state_hash(), other.hash()) << "step " << step;
    ASSERT_EQ(testing::first_difference(cpu->observations(), other.results.observation_view()), "") << "step " << step;
    ASSERT_TRUE(testing::same_bits(cpu->views(), Span<const View>(other.results.views))) << "step " << step;
    ASSERT_TRUE(testing::same_bits(cpu->arrays().driver, Span<const uint8_t>(other.results.driver)));
    ASSERT_TRUE(testing::same_bits(cpu->scene().agents, Span<const AgentBox>(other.host.state.boxes)))
        << "step " << step;
    if (step == steps) break;
    const auto step_both = [&](const auto& commands) {
      other.step(commands);
      return cpu->step(commands);
    };
    const auto key = static_cast<uint32_t>(step);
    std::vector<Command> commands;
    if (by_commands) commands = testing::mixed_commands(cpu->state(), cpu->num_slots(), key);
    for (size_t slot = 0; slot < commands.size(); ++slot) {
      const auto world = static_cast<size_t>(cpu->slots().world_of_slot[slot]);
      const bool is_recorded = maps[worlds[world].map]->scenario != nullptr;
      if (is_recorded && (slot + static_cast<size_t>(step) / 10) % 4 != 0)
        commands[slot] = {.kind = CommandKind::recorded};
    }
    const StepResult result =
        by_commands ? step_both(commands) : step_both(testing::mixed_actions(cpu->num_slots(), key));
    ASSERT_TRUE(testing::same_bits(result.reward, Span<const float>(other.results.reward))) << "step " << step;
    ASSERT_TRUE(testing::same_bits(result.terminated, Span<const uint8_t>(other.results.terminated)));
    ASSERT_TRUE(testing::same_bits(result.truncated, Span<const uint8_t>(other.results.truncated)));
    ASSERT_TRUE(testing::same_bits(result.valid, Span<const uint8_t>(other.results.valid)));
    ASSERT_TRUE(testing::same_bits(result.sums, Span<const StepSums>(other.results.sums)));
  }
  EXPECT_EQ(cpu->save(), other.save());
  EXPECT_EQ(other.rejected(), kNoRejection);
}

void expect_same(const SimulatorConfig& config, const std::vector<std::shared_ptr<const RoadMap>>& maps,
                 const std::vector<WorldSpec>& worlds, int steps, unsigned shuffle_seed, bool by_commands = false) {
  expect_same(config, compile_maps(maps, map_options(config)), worlds, steps, shuffle_seed, by_commands);
}

TEST(Phases, GiveTheBitsOfTheCpuExecutorInAnyOrderOfThreads) {
  SimulatorConfig config;
  config.episode_steps = 60;
  config.pedestrian_fraction = config.cyclist_fraction = 0.2f;
  config.parked_cars = 12;
  config.wall_observations = true;
  const std::vector<std::shared_ptr<const RoadMap>> maps{load_map("procedural:1"), load_map("procedural:2"),
                                                         testing::stadium(200, 2)};
  expect_same(config, maps, draw_worlds(5, 300, 1, 60, 3), 150, 1);
  config.vector_observations = config.auxiliary_observations = false;
  expect_same(config, maps, draw_worlds(6, 100, 1, 60, 3), 70, 2);
}

TEST(Phases, RunIndependentLights) {
  SimulatorConfig config;
  config.episode_steps = 40;
  config.light_cycles = LightCycles::independent;
  for (const bool fixed : {false, true}) {
    config.fixed_lights = fixed;
    expect_same(config, {load_map("procedural:1"), load_map("procedural:2")}, draw_worlds(5, 60, 1, 30, 2), 100, 12);
  }
}

TEST(Phases, LeaveAndEnterOpenRoads) {
  SimulatorConfig config;
  config.episode_steps = 400;
  config.reset_inactive_fraction = 2;
  config.parked_cars = 2;
  const std::vector<std::shared_ptr<const RoadMap>> maps{
      std::make_shared<RoadMap>(parse_opendrive(test::open_street(80), "street.xodr")),
      std::make_shared<RoadMap>(parse_opendrive(test::open_ramp(), "ramp.xodr"))};
  const std::vector<WorldSpec> worlds{{0, 20, 0}, {1, 30, 1}, {0, 3, 2}};
  const CompiledMaps compiled = compile_maps(maps, map_options(config));
  const auto cpu = make_simulator("cpu", config, compiled, worlds);
  testing::ShuffledExecutor other(config, compiled, worlds, 17);
  int64_t left = 0;
  for (uint32_t step = 0; step < 600; ++step) {
    const std::vector<int32_t> actions = testing::straight_actions(cpu->state(), cpu->num_slots());
    other.step(actions);
    const StepResult result = cpu->step(actions);
    ASSERT_EQ(cpu->state_hash(), other.hash()) << "step " << step;
    ASSERT_EQ(testing::first_difference(cpu->observations(), other.results.observation_view()), "") << "step " << step;
    ASSERT_TRUE(testing::same_bits(cpu->views(), Span<const View>(other.results.views))) << "step " << step;
    ASSERT_TRUE(testing::same_bits(result.terminated, Span<const uint8_t>(other.results.terminated)));
    ASSERT_TRUE(testing::same_bits(result.truncated, Span<const uint8_t>(other.results.truncated)));
    ASSERT_TRUE(testing::same_bits(result.valid, Span<const uint8_t>(other.results.valid)));
    for (int slot = 0; slot < cpu->num_slots(); ++slot) left += cpu->state().left[slot];
  }
  EXPECT_EQ(cpu->save(), other.save());
  EXPECT_GT(left, 20);
}

TEST(Phases, StaggerEpisodesAndResetAtStandstill) {
  SimulatorConfig config;
  config.episode_steps = 90;
  config.stagger_episodes = true;
  config.reset_inactive_fraction = 2;
  config.dynamics = {.reset_at_standstill = true};
  expect_same(config, {load_map("procedural:1"), testing::stadium(200, 2)}, draw_worlds(5, 60, 1, 8, 2), 200, 13);
}

TEST(Phases, ImpairAgents) {
  SimulatorConfig config;
  config.episode_steps = 90;
  config.pedestrian_fraction = config.cyclist_fraction = 0.2f;
  config.parked_cars = 12;
  config.others = {.blind = 0.3f, .phantom_braking = 0.2f, .inattentive = 0.2f, .policies = {0.1f, 0.1f}};
  const std::vector<std::shared_ptr<const RoadMap>> maps{load_map("procedural:1"), load_map("procedural:2")};
  for (const bool by_commands : {false, true}) {
    expect_same(config, maps, draw_worlds(5, 120, 1, 60, 2), 140, 14, by_commands);
  }
}

TEST(Phases, PlaceCrowdsAsSerialCodeDoes) {
  // A ring of 251 m holds about forty cars: almost every choice depends on earlier choices.
  const SimulatorConfig config = testing::cars({.episode_steps = 3});
  expect_same(config, {testing::ring_road(40)}, {{0, 300, 0}, {0, 37, 1}, {0, 1, 2}}, 12, 3);
}

TEST(Phases, SortCrowdsIntoCells) {
  SimulatorConfig config;
  config.episode_steps = 12;
  config.pedestrian_fraction = config.cyclist_fraction = 0.2f;
  config.parked_cars = 200;
  const auto town = load_map("procedural:1");
  expect_same(config, {town, testing::ring_road(40)}, {{0, 600, 0}, {0, 1, 1}, {0, 313, 2}, {1, 700, 3}}, 30, 14);
  expect_same(config, {town}, {{0, 600, 0}, {0, 20, 1}}, 14, 15, /*by_commands=*/true);
}

TEST(Phases, AdmitEnteringCrowds) {
  SimulatorConfig config;
  config.reset_inactive_fraction = 2;
  config.parked_cars = 2;
  const auto ramp = std::make_shared<RoadMap>(parse_opendrive(test::open_ramp(), "ramp.xodr"));
  expect_same(config, {ramp}, {{0, 600, 0}, {0, 3, 1}}, 60, 18);
}

TEST(Phases, BeginWorldsWithoutRoomForAgents) {
  SimulatorConfig config = testing::cars({.episode_steps = 30});
  config.pedestrian_fraction = 0.9f;  // the map has no walkway
  expect_same(config, {testing::ring_road(40)}, {{0, 2, 0}, {0, 1, 1}, {0, 1, 2}, {0, 30, 3}}, 40, 7);
}

TEST(Phases, TakeCommandsOfAllKinds) {
  SimulatorConfig config;
  config.episode_steps = 60;
  config.pedestrian_fraction = config.cyclist_fraction = 0.2f;
  config.parked_cars = 12;
  const std::vector<std::shared_ptr<const RoadMap>> maps{load_map("procedural:1"), testing::stadium(200, 2)};
  expect_same(config, maps, draw_worlds(5, 300, 1, 60, 2), 130, 6, /*by_commands=*/true);
}

TEST(Phases, FollowRecords) {
  const auto scene = test::crossing({.num_steps = 40, .num_pedestrians = 6});
  SimulatorConfig config = scene_config(*scene);
  config.episode_steps = 50;  // several episodes, each longer than the record
  MapOptions lit = map_options(config);
  lit.recorded_lights = true;
  const CompiledMaps maps{compile_scenario(scene, map_options(config)), compile_scenario(scene, lit, 20),
                          compile_map(testing::stadium(200, 2), map_options(config))};
  const std::vector<WorldSpec> worlds{
      scene_world(*maps[0], 0, 0), scene_world(*maps[1], 1, 1), {2, 20, 2}, scene_world(*maps[0], 0, 3)};
  expect_same(config, maps, worlds, 160, 9, /*by_commands=*/true);
  expect_same(config, maps, worlds, 60, 10);  // actions without commands take over all agents
}

TEST(Phases, FollowRecordsOfReplayedTracks) {
  const auto scene = test::crossing({.num_steps = 40, .num_pedestrians = 6});
  SimulatorConfig config = scene_config(*scene);
  config.reset_inactive_fraction = 1;
  config.leave_at_goal = true;
  config.others.blind = 0.3f;
  const auto whole = compile_scenario(scene, map_options(config));
  config.parked_cars = 6;
  const CompiledMaps maps{with_tracks(*whole, std::vector<int32_t>{2, 5, 0}, std::vector<int32_t>{9, 7, 1, 3}, 10),
                          with_tracks(*whole, std::vector<int32_t>{1}, std::vector<int32_t>{0, 2, 3, 4, 5, 6, 7}, 4),
                          compile_map(testing::stadium(200, 2), map_options(config))};
  const std::vector<WorldSpec> worlds{{0, 10, 0}, {1, 4, 1}, {0, 2, 2}, {2, 9, 3}};
  expect_same(config, maps, worlds, 130, 12);
  expect_same(config, maps, worlds, 60, 13, /*by_commands=*/true);
}

TEST(Phases, EndAgentsByTheRules) {
  const auto scene = test::crossing({.num_steps = 40, .num_pedestrians = 6});
  SimulatorConfig config = scene_config(*scene);
  config.leave_at_goal = true;
  for (const AfterInfraction after : {AfterInfraction::halt, AfterInfraction::leave, AfterInfraction::drive_on}) {
    config.after_infraction = after;
    const CompiledMaps maps{compile_scenario(scene, map_options(config)),
                            compile_map(testing::stadium(200, 2), map_options(config))};
    expect_same(config, maps, {scene_world(*maps[0], 0, 0), {1, 20, 1}}, 90, 11, /*by_commands=*/true);
  }
}

TEST(Phases, RefuseAnActionOutOfRangeAndChangeNothing) {
  const auto map = testing::stadium(200, 2);
  testing::ShuffledExecutor executor(testing::cars(), {map}, {{0, 30, 0}, {0, 10, 1}}, 4);
  std::vector<int32_t> actions = testing::mixed_actions(40, 0);
  executor.step(actions);
  const std::vector<uint8_t> before = executor.save();
  actions[31] = kNumActions;
  actions[35] = -1;
  executor.step(actions);
  EXPECT_EQ(executor.save(), before);
  EXPECT_EQ(executor.rejected(), rejected_command(31, kNumActions));
  actions[31] = 0;
  executor.step(actions);
  EXPECT_EQ(executor.save(), before);
  EXPECT_EQ(executor.rejected(), rejected_command(31, kNumActions)) << "the first one stands";
  actions[35] = 0;
  executor.step(actions);
  EXPECT_NE(executor.save(), before);
}

TEST(Phases, RefuseACommandOutOfRangeAndChangeNothing) {
  testing::ShuffledExecutor executor(testing::cars(), {testing::stadium(200, 2)}, {{0, 30, 0}, {0, 10, 1}}, 4);
  std::vector<Command> commands(40);
  const std::vector<uint8_t> before = executor.save();
  commands[31].kind = CommandKind::kinematic_state;
  commands[31].speed_mps = NAN;
  executor.step(commands);
  EXPECT_EQ(executor.save(), before);
  EXPECT_EQ(executor.rejected(), rejected_command(31, commands[31]));
  EXPECT_THAT(rejection_text(executor.rejected()), ::testing::HasSubstr("slot 31: expected a kinematic state"));
  commands[31].speed_mps = 0;
  executor.step(commands);
  EXPECT_NE(executor.save(), before);
}

/// Compares all public outputs.
void expect_same_view(Simulator* cpu, testing::ShuffledExecutor* other) {
  ASSERT_EQ(cpu->save(), other->save());
  ASSERT_EQ(testing::first_difference(cpu->observations(), other->results.observation_view()), "");
  ASSERT_TRUE(testing::same_bits(cpu->views(), Span<const View>(other->results.views)));
  ASSERT_TRUE(testing::same_bits(cpu->scene().agents, Span<const AgentBox>(other->host.state.boxes)));
}

TEST(Phases, BeginChosenWorldsAndSetChosenAgents) {
  SimulatorConfig config;
  config.episode_steps = 50;
  config.pedestrian_fraction = config.cyclist_fraction = 0.2f;
  config.parked_cars = 12;
  config.wall_observations = true;
  const std::vector<std::shared_ptr<const RoadMap>> maps{load_map("procedural:1"), testing::stadium(200, 2)};
  const std::vector<WorldSpec> worlds = draw_worlds(5, 200, 1, 60, 2);
  const auto cpu = make_simulator("cpu", config, maps, worlds);
  testing::ShuffledExecutor other(config, maps, worlds, 8);
  const int num_slots = cpu->num_slots();
  for (uint32_t round = 0; round < 12; ++round) {
    SCOPED_TRACE(round);
    const testing::RandomEdit edit(cpu->state(), num_slots, round);
    cpu->set_state(edit.slots(), edit.fields());
    other.set_state(state_edit(edit.slots(), edit.fields(), num_slots, {}));
    expect_same_view(cpu.get(), &other);
    std::vector<uint8_t> mask(worlds.size());
    for (size_t w = 0; w < mask.size(); ++w) mask[w] = (w + round) % 3 == 0;
    if (round % 2 == 1) {
      cpu->reset(mask, round);
      other.reset(mask, round);
      expect_same_view(cpu.get(), &other);
    }
    for (uint32_t step = 0; step < 20; ++step) {
      const std::vector<int32_t> actions = testing::mixed_actions(num_slots, 20 * round + step);
      cpu->step(actions);
      other.step(actions);
      ASSERT_EQ(cpu->state_hash(), other.hash()) << "step " << step;
    }
    expect_same_view(cpu.get(), &other);
  }
  EXPECT_EQ(other.faulty_edit(), kNoEditFault);
}

TEST(Phases, RefuseAWrongEditAndChangeNothing) {
  testing::ShuffledExecutor executor(testing::cars(), {testing::stadium(200, 2)}, {{0, 30, 0}, {0, 10, 1}}, 4);
  const std::vector<uint8_t> before = executor.save();
  const std::vector<int32_t> slots{5, 31, 7, 31};
  const std::vector<float> x_m{1, NAN, 2, NAN};
  const std::vector<NamedArray> fields{{"x_m", Array(x_m)}};
  executor.set_state(state_edit(slots, fields, 40, {}));
  EXPECT_EQ(executor.save(), before);
  EXPECT_EQ(edit_fault_text(executor.faulty_edit(), 40), "slot 31: x_m: the value is out of range");
  const std::vector<int32_t> other_slots{40}, good_slots{5};
  executor.set_state(state_edit(other_slots, {}, 40, {}));
  EXPECT_EQ(edit_fault_text(executor.faulty_edit(), 40), "slot 31: x_m: the value is out of range")
      << "the first one stands";
  executor.set_state(state_edit(good_slots, std::vector<NamedArray>{{"x_m", Array(x_m.data(), {1}, {})}}, 40, {}));
  EXPECT_NE(executor.save(), before);
}

TEST(Phases, AnswerQueriesAsTheCpuExecutorDoes) {
  SimulatorConfig config;
  config.pedestrian_fraction = config.cyclist_fraction = 0.2f;
  config.parked_cars = 12;
  const std::vector<std::shared_ptr<const RoadMap>> maps{load_map("procedural:1"), testing::stadium(200, 2)};
  const std::vector<WorldSpec> worlds = draw_worlds(5, 200, 1, 60, 2);
  for (uint32_t kind = 0; kind < 4; ++kind) {
    SCOPED_TRACE(kind);
    config.auxiliary_observations = kind % 2 == 0;
    config.wall_observations = kind < 2;
    config.vector_observations = kind < 3;
    const auto cpu = make_simulator("cpu", config, maps, worlds);
    testing::ShuffledExecutor other(config, maps, worlds, 9 + kind);
    for (uint32_t step = 0; step < 30; ++step) {
      const std::vector<int32_t> actions = testing::mixed_actions(cpu->num_slots(), step);
      cpu->step(actions);
      other.step(actions);
    }
    const testing::RandomQueries drawn(cpu.get(), 300, kind);
    testing::AnswerMemory expected(drawn.queries.size(), config), answers(drawn.queries.size(), config);
    cpu->observe(drawn.queries, drawn.hidden, drawn.inserted, expected.view());
    other.observe(drawn.asked(answers.view()));
    EXPECT_EQ(testing::first_difference(expected.view(), answers.view()), "");
    EXPECT_EQ(other.faulty_query(), kNoQueryFault);
    expect_same_view(cpu.get(), &other);
  }
}

TEST(Phases, RefuseAWrongQueryAndWriteNothing) {
  const SimulatorConfig config = testing::cars();
  testing::ShuffledExecutor executor(config, {testing::stadium(200, 2)}, {{0, 30, 0}, {0, 10, 1}}, 4);
  std::vector<ObservationQuery> queries(6);
  const std::vector<int32_t> hidden{1, 35};
  testing::AnswerMemory answers(queries.size(), config), untouched(queries.size(), config);
  const auto text_after = [&] {
    executor.observe({queries, hidden, {}, answers.view()});
    EXPECT_EQ(testing::first_difference(answers.view(), untouched.view()), "");
    return query_fault_text(executor.faulty_query(), 40);
  };
  queries[4].hidden_end = 2;
  queries[5].slot = 40;
  const std::string expected = "query 4: hidden: expected boxes of the slot's own world, got box 35 of the scene";
  EXPECT_EQ(text_after(), expected);
  queries[4].hidden_end = 1;
  EXPECT_EQ(text_after(), expected) << "the first one stands";
  queries[5].slot = 39;
  executor.observe({queries, hidden, {}, answers.view()});
  EXPECT_NE(testing::first_difference(answers.view(), untouched.view()), "");
}

TEST(Phases, CarlaTowns) {
  const std::vector<std::string> towns = known_towns();
  if (towns.empty()) GTEST_SKIP() << "no towns: set PICTURA_DATA";
  SimulatorConfig config;
  config.episode_steps = 15;
  for (const std::string& town : towns) {
    SCOPED_TRACE(town);
    expect_same(config, {load_map(town)}, {{0, 120, 0}}, 40, 5);
  }
}

}  // namespace
}  // namespace pictura
