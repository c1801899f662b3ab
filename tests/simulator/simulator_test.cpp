// The simulator's public behaviour: worlds, spawning, episodes, determinism, saving, bad input.
#include "pictura/simulator/simulator.h"

#include <array>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <numeric>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/backends/make_simulator.h"
#include "pictura/common/error.h"
#include "pictura/common/raster/check.h"
#include "pictura/map/load_map.h"
#include "pictura/simulator/observation_arrays.h"
#include "pictura/simulator/rules/limits.h"
#include "pictura/tests/simulator/cpu_simulator.h"
#include "pictura/tests/simulator/same_bits.h"
#include "pictura/tests/simulator/test_maps.h"
#include "pictura/tests/support/error_message.h"

namespace pictura {
namespace {

constexpr int32_t kCoast = 2 * kNumLatActions + 1;

using testing::make;
using testing::run;

TEST(Worlds, FillTheSlotsExactly) {
  const std::vector<WorldSpec> worlds = draw_worlds(3, 20480, 1, 120, 8);
  int slots = 0, smallest = 1000, largest = 0;
  for (size_t i = 0; i < worlds.size(); ++i) {
    EXPECT_EQ(worlds[i].map, static_cast<int>(i % 8));
    EXPECT_EQ(worlds[i].global_world, i);
    slots += worlds[i].num_agents;
    smallest = std::min(smallest, worlds[i].num_agents);
    largest = std::max(largest, worlds[i].num_agents);
  }
  EXPECT_EQ(slots, 20480);
  EXPECT_LE(smallest, 3);
  EXPECT_EQ(largest, 120);
  EXPECT_NEAR(static_cast<double>(worlds.size()), 20480 / 60.5, 40);
  EXPECT_EQ(draw_worlds(3, 50, 50, 50, 1).size(), 1u);
}

TEST(Worlds, RefuseInvalidOptions) {
  EXPECT_THROW(draw_worlds(0, 0, 1, 120, 1), UsageError);
  EXPECT_THROW(draw_worlds(0, 100'000'000, 1, 120, 1), UsageError);
  EXPECT_THROW(draw_worlds(0, 10, 0, 120, 1), UsageError);
  EXPECT_THROW(draw_worlds(0, 10, 5, 4, 1), UsageError);
  EXPECT_THROW(draw_worlds(0, 10, 1, 5000, 1), UsageError);
  EXPECT_THROW(draw_worlds(0, 10, 1, 5, 0), UsageError);
}

TEST(Simulator, RefusesInvalidOptions) {
  const auto map = testing::ring_road(40);
  EXPECT_THROW(make_simulator("warp", {}, {map}, {{0, 1, 0}}), UsageError);
  EXPECT_THROW(make({}, map, {{0, 0, 0}}), UsageError);
  EXPECT_THROW(make({}, map, {{0, 100'000'000, 0}}), UsageError);
  EXPECT_THROW(make({}, map, {{1, 1, 0}}), UsageError);
  EXPECT_THROW(make({}, map, {}), UsageError);
  EXPECT_THROW(make({}, nullptr, {{0, 1, 0}}), UsageError);
  EXPECT_THROW(make_simulator("cpu", {}, CompiledMaps{}, {{0, 1, 0}}), UsageError);
  EXPECT_THROW(make({.dt_s = 0}, map, {{0, 1, 0}}), UsageError);
  EXPECT_THROW(make({.dt_s = NAN}, map, {{0, 1, 0}}), UsageError);
  EXPECT_THROW(make({.dt_s = 0.11f}, map, {{0, 1, 0}}), UsageError);  // cars would jump over obstacles
  EXPECT_THROW(make({.episode_steps = 0}, map, {{0, 1, 0}}), UsageError);
  EXPECT_THROW(make({.pedestrian_fraction = 0.6f, .cyclist_fraction = 0.6f}, map, {{0, 1, 0}}), UsageError);
  SimulatorConfig config;
  config.conditioning[0] = {-1, 5, false};
  EXPECT_THROW(make(config, map, {{0, 1, 0}}), UsageError);
  try {
    make_simulator("warp", {}, {map}, {{0, 1, 0}});
  } catch (const UsageError& error) {
    EXPECT_NE(std::string(error.what()).find("cpu, "), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("auto"), std::string::npos);
  }
}

TEST(Simulator, RefusesOversizedWorldsBeforeItAllocates) {
  using ::testing::HasSubstr;
  const auto worlds_of = [](int count) {
    std::vector<WorldSpec> worlds;
    for (int w = 0; w < count; ++w) worlds.push_back({0, 1, static_cast<uint32_t>(w)});
    return worlds;
  };
  const auto refuse = [&worlds_of](const SimulatorConfig& config, std::shared_ptr<const RoadMap> map, int worlds) {
    return test::message_of<UsageError>([&] { make(config, std::move(map), worlds_of(worlds)); });
  };
  // 4,194,304 single agents with 4,096 parked cars each: 1.7e10 boxes.
  EXPECT_THAT(refuse({.parked_cars = 4096}, testing::ring_road(40), kMaxSlots), HasSubstr("got 17184063488 ("));
  // 5,000 lights in each of 4,000 worlds.
  auto lit = testing::ring_road(40);
  for (int i = 0; i < 5000; ++i) testing::add_light(lit.get(), 0, 4, 1, {0});
  EXPECT_THAT(refuse(testing::cars(), lit, 4000), HasSubstr("lights in all, got 20000000 ("));
  // A road of 5 km, with separate cells in each of 500,000 worlds.
  EXPECT_THAT(refuse(testing::cars(), testing::stadium(5000, 1), 500'000), HasSubstr("cells of 25 m in all"));
}

TEST(Simulator, RejectsAMapWithoutRoomToSpawn) {
  auto dead_end = testing::ring_road(40);
  for (Lane& lane : dead_end->lanes) lane.is_endless = false;
  EXPECT_THROW(make(testing::cars(), dead_end, {{0, 1, 0}}), Error);
  EXPECT_THROW(make(testing::cars(), std::make_shared<RoadMap>(), {{0, 1, 0}}), Error);
}

TEST(Simulator, RefusesActionsOutOfRangeAndChangesNothing) {
  const auto simulator = make(testing::cars(), testing::ring_road(40), {{0, 4, 0}});
  const uint64_t before = simulator->state_hash();
  std::vector<int32_t> actions(4, kCoast);
  for (const int32_t bad : {-1, kNumActions}) {
    actions[3] = bad;
    EXPECT_THROW(simulator->step(actions), Error);
  }
  EXPECT_EQ(simulator->state_hash(), before);
}

TEST(Simulator, RefusesActionArraysOfWrongTypeOrSize) {
  const auto simulator = make(testing::cars(), testing::ring_road(40), {{0, 4, 0}});
  const uint64_t before = simulator->state_hash();
  std::vector<int32_t> actions(8, kCoast);
  const auto refusal = [&](const Array& array) { return test::message_of([&] { simulator->step(array); }); };
  EXPECT_EQ(refusal(std::vector<float>(4)), "step: actions: expected i32 [4] on cpu, got f32 [4] on cpu");
  EXPECT_EQ(refusal({actions.data(), {3}, {}}), "step: actions: expected i32 [4] on cpu, got i32 [3] on cpu");
  EXPECT_EQ(refusal({actions.data(), {4, 1}, {}}), "step: actions: expected i32 [4] on cpu, got i32 [4, 1] on cpu");
  EXPECT_EQ(refusal({actions.data(), {4}, {MemorySpace::cuda, 1}}),
            "step: actions: expected i32 [4] on cpu, got i32 [4] on cuda:1");
  Array every_second(actions.data(), {4}, {});
  every_second.strides = {2};
  EXPECT_EQ(refusal(every_second), "step: actions: expected i32 [4] on cpu, got i32 [4] on cpu with strides [2]");
  EXPECT_EQ(simulator->state_hash(), before);
}

TEST(Simulator, SpawnsWithoutOverlapAndCountsRefusals) {
  // A ring of 251 m holds about forty cars with half a metre of clearance; 200 are requested.
  const auto simulator = make(testing::cars(), testing::ring_road(40), {{0, 200, 0}});
  const SpawnReport report = simulator->spawn_report();
  EXPECT_EQ(report.asked, 200);
  EXPECT_EQ(report.spawned + report.refused, report.asked);
  EXPECT_GT(report.spawned, 25);
  EXPECT_LT(report.spawned, 55);
  const SceneBatch& scene = simulator->scene();
  int drawn = 0;
  for (size_t i = 0; i < 200; ++i) {
    const AgentBox& a = scene.agents[i];
    drawn += a.drawn;
    if (!a.drawn) {
      EXPECT_EQ(simulator->state().status[i], AgentStatus::absent);
      EXPECT_EQ(simulator->views()[i].ego_agent, -1);
      continue;
    }
    EXPECT_GE(a.length_m, 3.5f);
    EXPECT_LE(a.length_m, 5.5f);
    EXPECT_GE(a.width_m, 1.6f);
    EXPECT_LE(a.width_m, 2.2f);
    // Cars are on the ring, along it.
    EXPECT_NEAR(length(a.center_m.xy()), 40, 0.2);
    EXPECT_NEAR(a.center_m.x * a.cos_heading + a.center_m.y * a.sin_heading, 0, 2);
    for (size_t j = 0; j < i; ++j) {
      const AgentBox& b = scene.agents[j];
      if (!b.drawn) continue;
      EXPECT_GT(length((a.center_m - b.center_m).xy()), 0.4f * (a.length_m + b.length_m));
    }
  }
  EXPECT_EQ(drawn, report.spawned);
  // Views of absent agents can be drawn with the other views.
  EXPECT_NO_THROW(check_views("cpu", scene, simulator->views()));
  // Refused spawns do not stop the other agents; the refused agents are never valid.
  const StepResult result = simulator->step(std::vector<int32_t>(200, kCoast));
  for (size_t i = 0; i < 200; ++i) EXPECT_EQ(result.valid[i], scene.agents[i].drawn);
}

TEST(Simulator, ViewsAreAtTheRearAxle) {
  const auto simulator = make(testing::cars(), testing::ring_road(40), {{0, 2, 0}, {0, 3, 1}});
  EXPECT_EQ(simulator->scene().world_begin[2], 5);
  for (size_t i = 0; i < 5; ++i) {
    const View& view = simulator->views()[i];
    const AgentBox& box = simulator->scene().agents[i];
    EXPECT_EQ(view.world, i < 2 ? 0 : 1);
    EXPECT_EQ(view.ego_agent, static_cast<int>(i));
    EXPECT_NEAR(box.center_m.x - view.origin_m.x, 0.3f * box.length_m * box.cos_heading, 1e-4);
    EXPECT_NEAR(box.center_m.y - view.origin_m.y, 0.3f * box.length_m * box.sin_heading, 1e-4);
    EXPECT_EQ(view.body_length_m, box.length_m);
  }
}

TEST(Simulator, ViewsAreKeyedByWorldAgentEpisodeAndStep) {
  const auto simulator = make(testing::cars({.episode_steps = 2}), testing::ring_road(40), {{0, 2, 70}, {0, 3, 71}});
  const std::vector<int32_t> actions(5, kCoast);
  for (uint32_t step = 0; step < 5; ++step) {
    for (uint32_t i = 0; i < 5; ++i) {
      const ViewKey& key = simulator->views()[i].key;
      EXPECT_EQ(key.world, i < 2 ? 70u : 71u);
      EXPECT_EQ(key.agent, i < 2 ? i : i - 2);
      EXPECT_EQ(key.episode, step / 3);
      EXPECT_EQ(key.step, step % 3);
    }
    simulator->step(actions);
  }
}

TEST(Simulator, EpisodesEndInTimeAndResetInTheNextStep) {
  const auto simulator = make(testing::cars({.episode_steps = 5}), testing::ring_road(40), {{0, 3, 0}});
  const std::vector<int32_t> actions(3, kCoast);
  const float first_x_m = simulator->state().x_m[0];
  for (int step = 1; step <= 5; ++step) {
    const StepResult result = simulator->step(actions);
    for (size_t i = 0; i < 3; ++i) {
      EXPECT_EQ(result.valid[i], 1) << step;
      EXPECT_EQ(result.terminated[i], 0);
      EXPECT_EQ(result.truncated[i], step == 5);
    }
    EXPECT_EQ(simulator->episode_over()[0], step == 5);
  }
  EXPECT_EQ(simulator->episode_step()[0], 5);
  EXPECT_EQ(simulator->state().x_m[0], first_x_m);  // agents have not moved: still the old episode
  const StepResult result = simulator->step(std::vector<int32_t>(3, -7));  // ignored
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(result.valid[i], 0);
    EXPECT_EQ(result.truncated[i], 0);
    EXPECT_EQ(result.reward[i], 0);
  }
  EXPECT_EQ(simulator->episode_step()[0], 0);
  EXPECT_EQ(simulator->episode_index()[0], 1);
  EXPECT_NE(simulator->state().x_m[0], first_x_m);
  EXPECT_EQ(simulator->step(actions).valid[0], 1);
  const SimulatorTotals& totals = simulator->totals();
  EXPECT_EQ(totals.agent_steps, 18);
  EXPECT_EQ(totals.slot_steps, 21);
  EXPECT_EQ(totals.episodes, 1);
  EXPECT_EQ(totals.finished_agent_episodes, 3);
}

TEST(Simulator, AnEpisodeLasts1280Steps) {
  const auto simulator =
      make(testing::cars({.num_threads = 1, .vector_observations = false}), testing::ring_road(40), {{0, 2, 0}});
  const std::vector<int32_t> actions(2, kCoast);
  for (int step = 1; step < 1280; ++step) ASSERT_EQ(simulator->step(actions).truncated[0], 0) << step;
  EXPECT_EQ(simulator->step(actions).truncated[0], 1);
}

TEST(Simulator, AWorldHolds4096Agents) {
  const auto map = load_map("procedural:1");
  const auto simulator = make({.vector_observations = false}, map, {{0, kMaxAgentsPerWorld, 0}});
  EXPECT_EQ(kMaxAgentsPerWorld, 4096);
  run(simulator.get(), 3);
  const SpawnReport report = simulator->spawn_report();
  EXPECT_EQ(report.asked, 4096);
  EXPECT_EQ(report.spawned + report.refused, 4096);
  EXPECT_GT(report.spawned, 500);
  EXPECT_GT(simulator->totals().agent_steps, 2 * report.spawned);
  EXPECT_THROW(make({}, map, {{0, kMaxAgentsPerWorld + 1, 0}}), UsageError);
}

TEST(Simulator, InfractionsTerminateAgentsAndManyEndTheEpisode) {
  // Full throttle straight on leaves the ring; the episode ends when the fourth of ten agents halts.
  const auto simulator = make(testing::cars(), testing::ring_road(40), {{0, 10, 0}});
  std::vector<int32_t> actions(10, 3 * kNumLatActions + 1);
  std::vector<uint8_t> halted(10, 0);
  int num_halted = 0;
  for (int step = 0; step < 300; ++step) {
    const StepResult result = simulator->step(actions);
    bool ended = false;
    for (size_t i = 0; i < 10; ++i) {
      EXPECT_EQ(result.valid[i], !halted[i]);
      EXPECT_FALSE(result.terminated[i] && result.truncated[i]);
      if (halted[i]) {
        EXPECT_EQ(result.reward[i], 0);
        EXPECT_EQ(result.terminated[i], 0);
      }
      halted[i] |= result.terminated[i];
      ended |= result.truncated[i] != 0;
    }
    num_halted = static_cast<int>(std::count(halted.begin(), halted.end(), 1));
    EXPECT_EQ(ended, num_halted >= 4) << step;
    if (ended) break;
  }
  EXPECT_GE(num_halted, 4);
  EXPECT_EQ(simulator->step(actions).valid[0], 0);
  EXPECT_EQ(simulator->episode_index()[0], 1);
}

TEST(Simulator, EpisodesDifferAndResetReturnsToTheFirst) {
  const auto simulator = make(testing::cars({.episode_steps = 20}), testing::ring_road(40), {{0, 8, 0}});
  const uint64_t first = simulator->state_hash();
  run(simulator.get(), 21);
  EXPECT_NE(simulator->state_hash(), first);
  simulator->reset();
  EXPECT_EQ(simulator->state_hash(), first);
  const auto other_seed = make(testing::cars({.seed = 1, .episode_steps = 20}), testing::ring_road(40), {{0, 8, 0}});
  EXPECT_NE(other_seed->state_hash(), first);
}

TEST(Simulator, AWorldDoesNotDependOnOtherWorlds) {
  const auto map = testing::stadium(200, 2);
  const auto both = make(testing::cars({.num_threads = 1}), map, {{0, 12, 0}, {0, 12, 1}});
  const auto second = make(testing::cars({.num_threads = 1}), map, {{0, 12, 1}});
  for (int step = 0; step < 60; ++step) {
    std::vector<int32_t> actions = testing::mixed_actions(24, static_cast<uint32_t>(step));
    both->step(actions);
    second->step(Span<const int32_t>(actions).subspan(12, 12));
  }
  for (int i = 0; i < 12; ++i) {
    EXPECT_EQ(both->state().x_m[12 + i], second->state().x_m[i]);
    EXPECT_EQ(both->state().episode_return[12 + i], second->state().episode_return[i]);
  }
}

TEST(Simulator, ResultsDoNotDependOnThreads) {
  auto map = testing::stadium(200, 2);
  testing::add_light(map.get(), 100, 8, 2, {0, 4});
  std::vector<uint64_t> hashes;
  for (const int threads : {1, 2, 3}) {
    const auto simulator = make(testing::cars({.num_threads = threads}), map, draw_worlds(2, 150, 1, 40, 1));
    run(simulator.get(), 300);
    hashes.push_back(simulator->state_hash());
    EXPECT_GT(simulator->totals().agent_steps, 20000);
  }
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_EQ(hashes[0], hashes[2]);
}

TEST(Simulator, SaveAndRestoreContinueIdentically) {
  auto map = testing::stadium(200, 2);
  testing::add_light(map.get(), 100, 8, 2, {0, 4});
  const std::vector<WorldSpec> worlds = draw_worlds(2, 60, 1, 40, 1);
  const SimulatorConfig config = testing::cars({.seed = 4, .episode_steps = 70});
  const auto original = make(config, map, worlds);
  run(original.get(), 100);
  const std::vector<uint8_t> bytes = original->save();
  const auto copy = make(config, map, worlds);
  copy->restore(bytes);
  const auto equal = [&] {
    const ObservationView a = original->observations(), b = copy->observations();
    EXPECT_EQ(original->state_hash(), copy->state_hash());
    EXPECT_TRUE(std::equal(a.ego.begin(), a.ego.end(), b.ego.begin()));
    EXPECT_TRUE(std::equal(a.partners.begin(), a.partners.end(), b.partners.begin()));
    EXPECT_TRUE(std::equal(a.lanes.begin(), a.lanes.end(), b.lanes.begin()));
    EXPECT_TRUE(std::equal(a.controls.begin(), a.controls.end(), b.controls.begin()));
    EXPECT_EQ(original->totals().agent_steps, copy->totals().agent_steps);
    EXPECT_EQ(original->totals().distance_m, copy->totals().distance_m);
    EXPECT_EQ(original->totals().finished_first_motion_s, copy->totals().finished_first_motion_s);
    EXPECT_EQ(original->totals().reward_terms.goal, copy->totals().reward_terms.goal);
    EXPECT_EQ(original->views()[7].origin_m.x, copy->views()[7].origin_m.x);
  };
  equal();
  run(original.get(), 100, 100);
  run(copy.get(), 100, 100);
  equal();

  EXPECT_THROW(copy->restore(std::vector<uint8_t>{}), Error);
  EXPECT_THROW(copy->restore(Span<const uint8_t>(bytes).subspan(0, bytes.size() - 1)), Error);
  std::vector<uint8_t> broken = bytes;
  broken[0] ^= 1;
  EXPECT_THROW(copy->restore(broken), Error);
  EXPECT_THROW(make(testing::cars({.seed = 5, .episode_steps = 70}), map, worlds)->restore(bytes), Error);
  equal();
}

/// Expects equal bits in all public outputs.
void expect_equal(Simulator* a, Simulator* b) {
  EXPECT_EQ(a->save(), b->save());
  EXPECT_EQ(testing::first_difference(a->observations(), b->observations()), "");
  EXPECT_TRUE(testing::same_bits(a->views(), b->views()));
  EXPECT_TRUE(testing::same_bits(a->scene().agents, b->scene().agents));
  EXPECT_TRUE(testing::same_bits(a->scene().world_begin, b->scene().world_begin));
  EXPECT_TRUE(testing::same_bits(a->slots().world_of_slot, b->slots().world_of_slot));
  EXPECT_TRUE(testing::same_bits(a->slots().agent_of_slot, b->slots().agent_of_slot));
}

TEST(Simulator, ReplacedWorldsEqualThoseOfANewSimulator) {
  SimulatorConfig config{.episode_steps = 25, .parked_cars = 5};
  const CompiledMaps maps =
      compile_maps({testing::stadium(200, 2), testing::ring_road(40), load_map("procedural:1")}, map_options(config));
  const auto simulator = make_simulator("cpu", config, maps, draw_worlds(2, 120, 1, 40, 3));
  run(simulator.get(), 30);
  const auto expect_fresh = [&](const CompiledMaps& other_maps, const std::vector<WorldSpec>& worlds, uint64_t seed) {
    simulator->set_worlds(other_maps, {}, worlds, seed);
    config.seed = seed;
    const auto fresh = make_simulator("cpu", config, other_maps, worlds);
    for (const uint32_t first_step : {0u, 30u}) {
      expect_equal(simulator.get(), fresh.get());
      EXPECT_EQ(simulator->totals().slot_steps, fresh->totals().slot_steps);
      run(simulator.get(), 30, first_step);
      run(fresh.get(), 30, first_step);
    }
    expect_equal(simulator.get(), fresh.get());
  };
  const AgentBox* const boxes = simulator->scene().agents.data();
  const float* const lanes = simulator->observations().lanes.data();
  expect_fresh({maps[1]}, {{0, 7, 3}, {0, 60, 1}}, 5);
  expect_fresh({maps[2], maps[0]}, {{1, 50, 3}, {0, 60, 1}}, 0);
  EXPECT_EQ(simulator->generation(), 0);
  EXPECT_EQ(simulator->scene().agents.data(), boxes);
  EXPECT_EQ(simulator->observations().lanes.data(), lanes);
  expect_fresh({maps[2]}, {{0, 300, 1}}, 0);
  EXPECT_EQ(simulator->generation(), 1);
}

TEST(Simulator, AddressesStayValidWithinReservedCapacity) {
  const SimulatorConfig config = testing::cars();
  const CompiledMaps maps = compile_maps({testing::stadium(200, 2)}, map_options(config));
  const auto simulator = make_simulator("cpu", config, maps, {{0, 10, 0}});
  const std::vector<WorldSpec> few{{0, 3, 0}}, many{{0, 100, 0}, {0, 40, 1}};
  run(simulator.get(), 5);
  const std::vector<uint8_t> before = simulator->save();
  simulator->reserve(capacity_of(maps, many));
  EXPECT_EQ(simulator->save(), before);
  const uint64_t generation = simulator->generation();
  const float* const x_m = simulator->state().x_m;
  const View* const views = simulator->views().data();
  const int32_t* const world_begin = simulator->scene().world_begin.data();
  for (const auto& worlds : {many, few, many}) {
    simulator->set_worlds(maps, {}, worlds, 1);
    run(simulator.get(), 5);
    EXPECT_EQ(simulator->state().x_m, x_m);
    EXPECT_EQ(simulator->views().data(), views);
    EXPECT_EQ(simulator->scene().world_begin.data(), world_begin);
  }
  EXPECT_EQ(simulator->generation(), generation);
}

TEST(Simulator, MapsAreSharedAndNamedByHandles) {
  const SimulatorConfig config = testing::cars();
  const CompiledMaps maps = compile_maps({testing::stadium(200, 2), testing::ring_road(40)}, map_options(config));
  const auto a = make_simulator("cpu", config, maps, {{0, 2, 0}, {1, 2, 1}});
  const auto b = make_simulator("cpu", config, maps, {{1, 2, 0}});
  EXPECT_EQ(a->maps()[1], b->maps()[1]);
  EXPECT_EQ(a->scene().geometry[1], 1);
  a->set_worlds(maps, {40, 7}, {{0, 2, 0}, {1, 2, 1}, {0, 1, 2}}, 0);
  const Span<const GeometryHandle> geometry = a->scene().geometry;
  EXPECT_EQ(std::vector<GeometryHandle>(geometry.begin(), geometry.end()), (std::vector<GeometryHandle>{40, 7, 40}));
  const auto refusal = [&](const CompiledMaps& other, std::vector<GeometryHandle> handles) {
    const std::vector<uint8_t> before = a->save();
    const std::string message =
        test::message_of<UsageError>([&] { a->set_worlds(other, std::move(handles), {{0, 2, 0}}, 0); });
    EXPECT_EQ(a->save(), before);
    return message;
  };
  using ::testing::HasSubstr;
  EXPECT_THAT(refusal(maps, {1}), HasSubstr("expected a handle for each of 2 maps, got 1"));
  EXPECT_THAT(refusal(maps, {1, -1}), HasSubstr("expected handles in [0, 65536), got -1"));
  EXPECT_THAT(refusal({nullptr}, {}), HasSubstr("got a null pointer"));
  EXPECT_THAT(refusal({compile_map(testing::ring_road(40), {.walls = !config.walls})}, {}),
              HasSubstr("map ring: expected a map compiled with walls"));
  MapOptions seen = map_options(config);
  seen.light_heads = LightHeads::visible;
  EXPECT_THAT(refusal({compile_map(testing::ring_road(40), seen)}, {}),
              HasSubstr("map ring: expected a map compiled with light heads as_mapped, got visible"));
}

TEST(Simulator, ASnapshotKeepsItsState) {
  const SimulatorConfig config = testing::cars({.episode_steps = 20});
  const auto simulator = make(config, testing::stadium(200, 2), draw_worlds(2, 60, 1, 40, 1));
  run(simulator.get(), 35);
  const auto snapshot = simulator->snapshot();
  const std::vector<uint8_t> bytes = simulator->save();
  run(simulator.get(), 30, 35);
  const std::vector<uint8_t> later = simulator->save();
  simulator->restore(*snapshot);
  EXPECT_EQ(simulator->save(), bytes);
  run(simulator.get(), 30, 35);
  EXPECT_EQ(simulator->save(), later);
  const auto other = make(config, testing::stadium(200, 2), draw_worlds(2, 60, 1, 40, 1));
  EXPECT_THROW(other->restore(*snapshot), Error);
  simulator->set_worlds(simulator->maps(), {}, simulator->worlds(), 0);
  EXPECT_THROW(simulator->restore(*snapshot), Error);
}

/// Returns the steps of the first and second episodes of each one-agent world, under no jerk.
std::array<std::vector<int32_t>, 2> episode_lengths(Simulator* simulator, int episode_steps) {
  const auto num_worlds = simulator->worlds().size();
  std::array<std::vector<int32_t>, 2> lengths{std::vector<int32_t>(num_worlds), std::vector<int32_t>(num_worlds)};
  const std::vector<int32_t> actions(num_worlds, kIdleAction);
  int truncated = 0;
  for (int step = 0; step < 2 * episode_steps + 1; ++step) {
    const StepResult result = simulator->step(actions);
    for (size_t w = 0; w < num_worlds; ++w) {
      if (!simulator->episode_over()[w]) continue;
      lengths[simulator->episode_index()[w]][w] = simulator->episode_step()[w];
      const bool drives = simulator->state().status[w] == AgentStatus::active;
      EXPECT_EQ(result.truncated[w], drives) << w;  // values of agents that still drive at the end bootstrap
      truncated += drives;
    }
  }
  EXPECT_GT(truncated, 0);
  return lengths;
}

TEST(Simulator, StaggeredWorldsEndTheirEpisodesAtDifferentTimes) {
  constexpr int kSteps = 100, kWorlds = 200, kMinSteps = 64;
  SimulatorConfig config = testing::cars({.seed = 3, .episode_steps = kSteps, .reset_inactive_fraction = 2});
  std::vector<WorldSpec> worlds;  // worlds of one agent each, so that slots are worlds
  for (uint32_t w = 0; w < kWorlds; ++w) worlds.push_back({0, 1, w});
  const auto plain = make(config, testing::ring_road(40), worlds);
  for (const std::vector<int32_t>& whole : episode_lengths(plain.get(), kSteps)) {
    EXPECT_THAT(whole, ::testing::Each(kSteps));
  }

  config.stagger_episodes = true;
  const auto simulator = make(config, testing::ring_road(40), worlds);
  const auto [first, second] = episode_lengths(simulator.get(), kSteps);
  EXPECT_THAT(first, ::testing::Each(::testing::AllOf(::testing::Ge(kMinSteps), ::testing::Le(kSteps))));
  EXPECT_THAT(second, ::testing::Each(::testing::AllOf(::testing::Ge(kSteps - kSteps / 8), ::testing::Le(kSteps))));
  // The mean of 200 draws of U{64, ..., 100} is 82 +- 0.75.
  EXPECT_NEAR(std::accumulate(first.begin(), first.end(), 0.0) / kWorlds, 82, 3);
  EXPECT_GE(std::set<int32_t>(first.begin(), first.end()).size(), 30u);  // there are 37 possible lengths
  // The mean of 200 draws of U{88, ..., 100} is 94 +- 0.27.
  EXPECT_NEAR(std::accumulate(second.begin(), second.end(), 0.0) / kWorlds, 94, 1);
  EXPECT_EQ(std::set<int32_t>(second.begin(), second.end()).size(), 13u);

  // Another seed gives other lengths; a reset to that seed gives the lengths of a new simulator.
  config.seed = 4;
  const auto other = make(config, testing::ring_road(40), worlds);
  const std::vector<uint8_t> all(kWorlds, 1);
  simulator->reset(all, 4);
  const auto after_reset = episode_lengths(simulator.get(), kSteps), fresh = episode_lengths(other.get(), kSteps);
  EXPECT_EQ(after_reset, fresh);
  EXPECT_NE(fresh[0], first);
}

TEST(Simulator, StaggeredWorldsContinueExactlyFromASavedState) {
  const SimulatorConfig config =
      testing::cars({.episode_steps = 90, .reset_inactive_fraction = 2, .stagger_episodes = true});
  const std::vector<WorldSpec> worlds = draw_worlds(2, 30, 1, 3, 1);
  const auto simulator = make(config, testing::ring_road(40), worlds),
             copy = make(config, testing::ring_road(40), worlds);
  run(simulator.get(), 50);
  copy->restore(simulator->save());
  run(simulator.get(), 100, 50);
  run(copy.get(), 100, 50);
  EXPECT_EQ(copy->save(), simulator->save());
}

TEST(Simulator, ShortEpisodesAreNotStaggered) {
  const auto simulator =
      make(testing::cars({.episode_steps = 64, .reset_inactive_fraction = 2, .stagger_episodes = true}),
           testing::ring_road(40), {{0, 1, 0}, {0, 1, 1}, {0, 1, 2}});
  for (const std::vector<int32_t>& lengths : episode_lengths(simulator.get(), 64)) {
    EXPECT_THAT(lengths, ::testing::Each(64));
  }
}

TEST(Simulator, RestoreErrorsNameTheDifference) {
  using ::testing::HasSubstr;
  const auto make_map = [] {
    auto map = testing::stadium(200, 2);
    testing::add_light(map.get(), 100, 8, 2, {0, 4});
    return map;
  };
  const std::vector<WorldSpec> worlds{{0, 4, 0}};
  const std::vector<uint8_t> bytes = make({}, make_map(), worlds)->save();
  const auto difference = [&](const SimulatorConfig& config, std::shared_ptr<const RoadMap> map) {
    const auto simulator = make(config, std::move(map), worlds);
    return test::message_of([&] { simulator->restore(bytes); });
  };
  EXPECT_EQ(difference({}, make_map()), test::kNoError);
  EXPECT_EQ(difference({.num_threads = 1, .vector_observations = false}, make_map()), test::kNoError);
  EXPECT_THAT(difference({.seed = 1}, make_map()), HasSubstr("seed"));
  EXPECT_THAT(difference({.dt_s = 0.05f}, make_map()), HasSubstr("dt_s"));
  EXPECT_THAT(difference({.cyclist_fraction = 0.5f}, make_map()), HasSubstr("cyclist_fraction"));
  EXPECT_THAT(difference({.wall_seed = 1}, make_map()), HasSubstr("wall_seed"));
  EXPECT_THAT(difference({.fixed_lights = true}, make_map()), HasSubstr("fixed_lights"));
  EXPECT_THAT(difference({.stagger_episodes = true}, make_map()), HasSubstr("stagger_episodes"));
  EXPECT_THAT(difference({.dynamics = {.reset_at_standstill = true}}, make_map()), HasSubstr("reset_at_standstill"));
  EXPECT_THAT(difference({.light_cycles = LightCycles::independent}, make_map()), HasSubstr("light_cycles"));
  SimulatorConfig config;
  config.conditioning[3].high = 2;
  EXPECT_THAT(difference(config, make_map()), HasSubstr("conditioning"));
  // Maps with equal counts of everything, but one element edited.
  const std::vector<std::function<void(RoadMap*)>> edits{
      [](RoadMap* map) { map->lane_points[5].position_m.z += 0.5f; },
      [](RoadMap* map) { map->lanes[2].speed_limit_mps = 11; },
      [](RoadMap* map) { std::swap(map->lane_links[0], map->lane_links[2]); },
      [](RoadMap* map) { map->road_edges[7].a_m.x += 0.01f; },
      [](RoadMap* map) { map->lights[0].stop_a_m.x += 0.01f; },
      [](RoadMap* map) { map->light_lanes[1] = 5; },
  };
  for (size_t i = 0; i < edits.size(); ++i) {
    const auto map = make_map();
    edits[i](map.get());
    EXPECT_THAT(difference({}, map), HasSubstr("map stadium")) << i;
  }
}

TEST(Simulator, RestoreRefusesFieldsOutOfRangeAndChangesNothing) {
  using ::testing::HasSubstr;
  const auto map = testing::stadium(200, 2);
  const std::vector<WorldSpec> worlds{{0, 4, 0}};
  const auto simulator = make(testing::cars(), map, worlds);
  run(simulator.get(), 3);
  const uint64_t hash = simulator->state_hash();
  const auto refusal = [&](const std::function<void(AgentStateView)>& spoil) {
    const auto spoilt = make(testing::cars(), map, worlds);
    spoil(spoilt->state());
    const std::vector<uint8_t> bytes = spoilt->save();
    const std::string message = test::message_of([&] { simulator->restore(bytes); });
    EXPECT_EQ(simulator->state_hash(), hash);
    return message;
  };
  EXPECT_THAT(refusal([](AgentStateView state) { state.lane[3] = 8; }), HasSubstr("agent 3: lane: 8"));
  EXPECT_THAT(refusal([](AgentStateView state) { state.lane[3] = -2; }), HasSubstr("agent 3: lane: -2"));
  EXPECT_THAT(refusal([](AgentStateView state) { state.goal_lane[1] = -1; }), HasSubstr("agent 1: goal_lane: -1"));
  EXPECT_THAT(refusal([](AgentStateView state) { state.next_waypoint[0] = 3; }), HasSubstr("next_waypoint: 3"));
  EXPECT_THAT(refusal([](AgentStateView state) { state.first_motion_step[0] = -1; }), HasSubstr("first_motion_step"));
  EXPECT_THAT(refusal([](AgentStateView state) { state.agent_class[2] = AgentClass{3}; }), HasSubstr("agent_class: 3"));
  EXPECT_THAT(refusal([](AgentStateView state) { state.status[2] = AgentStatus{4}; }), HasSubstr("status: 4"));
  EXPECT_THAT(refusal([](AgentStateView state) { state.status[2] = AgentStatus::parked; }), HasSubstr("status: 2"));
  EXPECT_THAT(refusal([](AgentStateView state) { state.x_m[2] = NAN; }), HasSubstr("x_m"));
  EXPECT_THAT(refusal([](AgentStateView state) { state.y_m[2] = 1e9f; }), HasSubstr("agent 2: y_m"));
  EXPECT_THAT(refusal([](AgentStateView state) { state.conditioning[20] = INFINITY; }), HasSubstr("conditioning"));
  EXPECT_EQ(test::message_of([&] { simulator->restore(make(testing::cars(), map, worlds)->save()); }), test::kNoError);
}

TEST(Simulator, ConditioningIsDrawnAsInThePaper) {
  const auto simulator = make(testing::cars(), testing::stadium(1500, 2), draw_worlds(1, 4000, 100, 100, 1));
  const AgentStateView state = simulator->state();
  for (int c = 0; c < kNumConditioning; ++c) {
    const ConditioningRange& range = kPaperConditioning[c];
    double sum = 0;
    int below_one = 0;
    for (int i = 0; i < 4000; ++i) {
      const float value = state.conditioning[i * kNumConditioning + c];
      ASSERT_GE(value, range.low);
      ASSERT_LE(value, range.high);
      sum += value;
      below_one += value < 1;
    }
    const double spread = range.high - range.low;
    const double mean = range.mixture ? 0.25 * (range.low + 2 + range.high) : 0.5 * (range.low + range.high);
    EXPECT_NEAR(sum / 4000, mean, 0.02 * spread + 1e-9) << kConditioningNames[c];
    if (range.mixture) {
      EXPECT_NEAR(below_one, 2000, 130);
    }
  }
}

TEST(Simulator, DisablingVectorObservationsChangesNothingElse) {
  const auto with = make(testing::cars(), testing::ring_road(40), {{0, 8, 0}});
  const auto without = make(testing::cars({.vector_observations = false}), testing::ring_road(40), {{0, 8, 0}});
  run(with.get(), 50);
  run(without.get(), 50);
  EXPECT_EQ(with->state_hash(), without->state_hash());
  EXPECT_TRUE(without->observations().lanes.empty());
  const Span<float> a = with->observations().ego, b = without->observations().ego;
  EXPECT_TRUE(std::equal(a.begin(), a.end(), b.begin()));
}

TEST(Simulator, ObservationsAreNamedArraysOfOneList) {
  SimulatorConfig config = testing::cars();
  config.wall_observations = true;
  const auto all = make(config, testing::ring_road(40), {{0, 8, 0}});
  const std::vector<NamedArray> arrays = observation_arrays(all->observations(), 8, all->device());
  size_t expected = 0;
  for (const ObservationArray& listed : kObservationArrays) {
    // The array `walls` is absent on a map without walls.
    if (listed.name == "walls" && all->observations().walls.empty()) continue;
    ASSERT_LT(expected, arrays.size());
    const NamedArray& named = arrays[expected++];
    EXPECT_EQ(named.name, listed.name);
    EXPECT_EQ(named.array.type, listed.type);
    EXPECT_EQ(named.array.shape, (Dims{8, listed.rows, listed.features}));
    EXPECT_TRUE(named.array.device.is_host());
  }
  EXPECT_EQ(arrays.size(), expected);
  EXPECT_EQ(arrays[1].array.checked<float>("partners", {8, 16, 8}, {}).data(), all->observations().partners.data());
  config.vector_observations = false;
  const auto own = make(config, testing::ring_road(40), {{0, 8, 0}});
  std::vector<std::string> names;
  for (const NamedArray& named : observation_arrays(own->observations(), 8, {})) names.emplace_back(named.name);
  EXPECT_EQ(names, (std::vector<std::string>{"ego", "conditioning", "waypoints"}));
}

TEST(Simulator, TotalsAreSubtractedFieldByField) {
  const auto simulator = make(testing::cars(), testing::ring_road(40), {{0, 8, 0}});
  run(simulator.get(), 20);
  const SimulatorTotals before = simulator->totals();
  run(simulator.get(), 30, 20);
  SimulatorTotals since = simulator->totals();
  since.subtract(before);
  EXPECT_EQ(since.slot_steps, 8 * 30);
  EXPECT_EQ(since.agent_steps, simulator->totals().agent_steps - before.agent_steps);
  EXPECT_EQ(since.distance_m, simulator->totals().distance_m - before.distance_m);
}

constexpr int32_t kFullThrottle = 3 * kNumLatActions + 1;

TEST(Simulator, TotalsHaveEachRewardTermOfLiveAgents) {
  // All agents pass waypoints on straights and leave the road in the first curve.
  SimulatorConfig config = testing::cars({.walls = false});
  const auto fix = [&config](Conditioning which, float value) {
    config.conditioning[static_cast<int>(which)] = {value, value, false};
  };
  fix(Conditioning::v_goal_mps, 30);
  fix(Conditioning::off_road, 2);
  fix(Conditioning::stop_line, 0.5f);
  const auto simulator = make(config, testing::stadium(200, 2), {{0, 12, 0}, {0, 7, 1}});
  RewardTermsOf<double> of_steps;
  for (int step = 0; step < 400; ++step) {
    const StepResult result = simulator->step(std::vector<int32_t>(19, kFullThrottle));
    for (size_t slot = 0; slot < 19; ++slot) {
      const RewardTerms& its = result.sums[slot].reward_terms;
      ASSERT_EQ(its.total(), result.reward[slot]);
#define X(name) of_steps.name += static_cast<double>(its.name);
      PICTURA_REWARD_TERMS(X)
#undef X
    }
  }
  const SimulatorTotals& totals = simulator->totals();
  EXPECT_NEAR(of_steps.lane_align, totals.reward_terms.lane_align, 1e-9);
  EXPECT_EQ(of_steps.goal, totals.reward_terms.goal);
  const RewardTermsOf<double>& terms = totals.reward_terms;
  ASSERT_GT(totals.waypoints_reached, 10);
  ASSERT_GT(totals.off_road, 10);
  EXPECT_EQ(terms.goal, static_cast<double>(totals.waypoints_reached));
  EXPECT_EQ(terms.off_road, -2.0 * static_cast<double>(totals.off_road));
  EXPECT_EQ(terms.stop_line, -0.5 * static_cast<double>(totals.red_light));
  EXPECT_EQ(terms.collision == 0, totals.collisions == 0);
  EXPECT_NEAR(terms.timestep, -2.5e-6 * static_cast<double>(totals.agent_steps), 1e-6) << "all accelerate or drive";
  EXPECT_GT(terms.velocity, 0);
  EXPECT_EQ(terms.reverse, 0);
  EXPECT_LT(terms.comfort, 0);
  EXPECT_NEAR(terms.total(), totals.reward, 1e-4);
}

TEST(Simulator, TotalsCountFirstMovesAndPassedWaypoints) {
  const auto simulator = make(testing::cars({.episode_steps = 60}), testing::stadium(400, 2), {{0, 10, 0}});
  const AgentStateView state = simulator->state();
  std::vector<int32_t> actions(10, kCoast);
  // Agent i of the first half rests for 3 i steps; the other half stays in place.
  std::vector<int> first_motion(10, 0);
  for (int step = 1; step <= 60; ++step) {
    for (int i = 0; i < 5; ++i) actions[i] = step > 3 * i ? kFullThrottle : kCoast;
    simulator->step(actions);
    for (size_t i = 0; i < 10; ++i) {
      if (first_motion[i] == 0 && std::fabs(state.speed_mps[i]) > kRest_mps) first_motion[i] = step;
      ASSERT_EQ(state.first_motion_step[i], first_motion[i]) << "step " << step << ", agent " << i;
    }
  }
  ASSERT_EQ(simulator->totals().collisions, 0) << "a halted agent shows no speed";
  double expected_s = 0;
  int64_t passed = 0;
  for (size_t i = 0; i < 10; ++i) {
    EXPECT_EQ(first_motion[i] > static_cast<int>(3 * i), i < 5) << i;
    expected_s += first_motion[i] * static_cast<double>(simulator->config().dt_s);
    passed += state.waypoints_reached[i] > 0;
  }
  const SimulatorTotals first = simulator->totals();
  EXPECT_EQ(first.finished_agent_episodes, 10);
  EXPECT_EQ(first.finished_moved, 5);
  EXPECT_DOUBLE_EQ(first.finished_first_motion_s, expected_s);
  ASSERT_GT(passed, 0);
  EXPECT_EQ(first.finished_passed_waypoint, passed);

  // In the next episode no agent moves.
  for (int step = 0; step <= 60; ++step) simulator->step(std::vector<int32_t>(10, kCoast));
  const SimulatorTotals& both = simulator->totals();
  EXPECT_EQ(both.finished_agent_episodes, 20);
  EXPECT_EQ(both.finished_moved, first.finished_moved);
  EXPECT_EQ(both.finished_first_motion_s, first.finished_first_motion_s);
  EXPECT_EQ(both.finished_passed_waypoint, first.finished_passed_waypoint);
}

TEST(Simulator, ClassesHaveThePapersSharesAndSizes) {
  SimulatorConfig config;
  EXPECT_EQ(config.parked_cars, 32);
  EXPECT_TRUE(config.walls);
  config.vector_observations = false;
  constexpr int kAgents = 4000;
  const auto simulator = make(config, load_map("procedural:1"), draw_worlds(1, kAgents, 100, 100, 1));
  const AgentStateView state = simulator->state();
  int counts[kNumAgentClasses] = {};
  for (int i = 0; i < kAgents; ++i) {
    ++counts[static_cast<int>(state.agent_class[i])];
    const ClassLimits limits = class_limits(state.agent_class[i]);
    ASSERT_GE(state.length_m[i], limits.min_length_m);
    ASSERT_LE(state.length_m[i], limits.max_length_m);
    ASSERT_GE(state.width_m[i], limits.min_width_m);
    ASSERT_LE(state.width_m[i], limits.max_width_m);
    ASSERT_EQ(state.height_m[i], limits.height_m);
  }
  // Three standard deviations of a binomial distribution.
  EXPECT_NEAR(counts[static_cast<int>(AgentClass::vehicle)], 0.8 * kAgents, 76);
  EXPECT_NEAR(counts[static_cast<int>(AgentClass::cyclist)], 0.1 * kAgents, 57);
  EXPECT_NEAR(counts[static_cast<int>(AgentClass::pedestrian)], 0.1 * kAgents, 57);
}

TEST(Simulator, CyclistsAreSmallerAndSlower) {
  const auto simulator =
      make({.pedestrian_fraction = 0, .cyclist_fraction = 0.5f}, testing::stadium(1500, 2), {{0, 100, 0}});
  run(simulator.get(), 20);
  int cyclists = 0;
  for (size_t i = 0; i < 100; ++i) {
    const AgentBox& box = simulator->scene().agents[i];
    if (box.agent_class != AgentClass::cyclist) continue;
    ++cyclists;
    EXPECT_LE(box.length_m, 1.9f);
    EXPECT_LE(box.width_m, 0.7f);
  }
  EXPECT_NEAR(cyclists, 50, 18);
}

TEST(Simulator, ParkedCarsStandBesideAndOnTheRoad) {
  auto map = testing::ring_road(40);
  // A sidewalk outside the outer edge, at 42 m: cars of 1.6 to 2.2 m stand 0.2 m from the sidewalk.
  Lane sidewalk;
  sidewalk.type = LaneType::sidewalk;
  sidewalk.points.begin = static_cast<int32_t>(map->lane_points.size());
  for (int i = 0; i <= 120; ++i) {
    const float angle = kTwoPi * static_cast<float>(i) / 120;
    map->lane_points.push_back(
        {{43.5f * std::cos(angle), 43.5f * std::sin(angle), 0}, angle, 3, 2.27f * static_cast<float>(i)});
  }
  sidewalk.points.end = static_cast<int32_t>(map->lane_points.size());
  map->lanes.push_back(sidewalk);
  const auto simulator = make({.episode_steps = 30, .pedestrian_fraction = 0, .cyclist_fraction = 0, .parked_cars = 12},
                              map, {{0, 4, 0}, {0, 3, 1}});
  const SpawnReport report = simulator->spawn_report();
  EXPECT_EQ(report.parked_asked, 24);
  EXPECT_EQ(report.parked_placed, 24);
  const SceneBatch& scene = simulator->scene();
  EXPECT_EQ(scene.world_begin[1], 16);
  EXPECT_EQ(scene.world_begin[2], 31);
  for (size_t i = 4; i < 16; ++i) {
    const AgentBox& box = scene.agents[i];
    EXPECT_EQ(box.palette, 2);
    EXPECT_NEAR(length(box.center_m.xy()), 42.2f + 0.5f * box.width_m, 0.1);
    // Parked cars head in the direction of the counter-clockwise traffic.
    EXPECT_GT(box.center_m.x * box.sin_heading - box.center_m.y * box.cos_heading, 40);
  }
  const AgentBox first = scene.agents[4];
  const uint64_t hash = simulator->state_hash();
  run(simulator.get(), 10);
  EXPECT_EQ(scene.agents[4].center_m.x, first.center_m.x);
  run(simulator.get(), 30, 10);
  EXPECT_NE(scene.agents[4].center_m.x, first.center_m.x);  // a new episode
  simulator->reset();
  EXPECT_EQ(simulator->state_hash(), hash);
}

TEST(Simulator, NoAgentSpawnsAcrossAStopLine) {
  auto map = testing::stadium(200, 1);
  for (const float x_m : {40.0f, 80.0f, 120.0f, 160.0f}) testing::add_light(map.get(), x_m, 4, 1, {0});
  const auto simulator = make(testing::cars(), map, draw_worlds(1, 2000, 4, 4, 1));
  const AgentStateView state = simulator->state();
  int on_straight = 0;
  for (size_t i = 0; i < 2000; ++i) {
    const AgentBox& box = simulator->scene().agents[i];
    if (!box.drawn || box.center_m.y > 1 || box.center_m.x < 10 || box.center_m.x > 190) continue;
    ++on_straight;
    const float bumper_m = box.center_m.x + 0.5f * box.length_m;
    for (const float line_m : {40.0f, 80.0f, 120.0f, 160.0f}) {
      EXPECT_FALSE(state.x_m[i] < line_m && bumper_m >= line_m) << "agent " << i << " at " << state.x_m[i];
    }
  }
  EXPECT_GT(on_straight, 400);
}

TEST(Simulator, AWorldWithoutAgentsEndsAfterOneStep) {
  SimulatorConfig config = testing::cars();
  config.pedestrian_fraction = 1;  // the map has no walkway
  const auto simulator = make(config, testing::ring_road(40), {{0, 5, 0}});
  EXPECT_EQ(simulator->spawn_report().refused_no_place, 5);
  const std::vector<int32_t> actions(5, kCoast);
  for (int episode = 0; episode < 3; ++episode) {
    EXPECT_EQ(simulator->episode_index()[0], episode);
    simulator->step(actions);
    EXPECT_EQ(simulator->episode_index()[0], episode);
    simulator->step(actions);
  }
  EXPECT_EQ(simulator->totals().agent_steps, 0);
}

/// A real town: in a run long enough for every event to happen, the counts must be consistent.
TEST(Simulator, Town01RunsWithValidStates) {
  const char* data = std::getenv("PICTURA_DATA");
  if (!data) GTEST_SKIP() << "PICTURA_DATA names no folder of maps";
  const auto map = load_map("Town01");
  std::vector<uint64_t> hashes;
  for (const int threads : {1, 2, 3}) {
    const auto simulator = make({.num_threads = threads}, map, {{0, 60, 0}, {0, 60, 1}});
    EXPECT_EQ(simulator->spawn_report().refused, 0);
    // Agents never spawn in an infraction: a step without moving has no events.
    simulator->step(std::vector<int32_t>(120, kCoast));
    EXPECT_EQ(simulator->totals().collisions + simulator->totals().off_road + simulator->totals().red_light, 0);
    run(simulator.get(), 300);
    hashes.push_back(simulator->state_hash());
    const SimulatorTotals& totals = simulator->totals();
    EXPECT_GT(totals.agent_steps, 10000);
    EXPECT_GT(totals.off_road, 0);
    EXPECT_GT(totals.distance_m, 1000);
    EXPECT_LE(totals.at_fault_collisions, totals.collisions);
    const AgentStateView state = simulator->state();
    for (int i = 0; i < 120; ++i) EXPECT_TRUE(std::isfinite(state.x_m[i]) && std::isfinite(state.episode_return[i]));
  }
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_EQ(hashes[0], hashes[2]);
}

}  // namespace
}  // namespace pictura
