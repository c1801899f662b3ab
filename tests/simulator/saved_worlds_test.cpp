// Worlds that move between simulators. Worlds that are divided among several simulators step and save as in one
// simulator of all worlds. Single worlds continue in other simulators.
#include "pictura/simulator/saved_worlds.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/backends/make_simulator.h"
#include "pictura/common/error.h"
#include "pictura/map/load_map.h"
#include "pictura/tests/simulator/same_bits.h"
#include "pictura/tests/simulator/test_maps.h"
#include "pictura/tests/support/error_message.h"

namespace pictura {
namespace {

using ::testing::HasSubstr;

int64_t agents_of(const std::vector<WorldSpec>& worlds) {
  int64_t sum = 0;
  for (const WorldSpec& world : worlds) sum += world.num_agents;
  return sum;
}

TEST(PartsOfWorlds, AreConsecutiveAndNearlyEqual) {
  const std::vector<WorldSpec> all = draw_worlds(3, 20480, 1, 120, 8);
  for (const int num_parts : {1, 2, 3, 8}) {
    size_t next = 0;
    for (int part = 0; part < num_parts; ++part) {
      const std::vector<WorldSpec> worlds = worlds_in_part(all, part, num_parts);
      EXPECT_NEAR(static_cast<double>(agents_of(worlds)), 20480.0 / num_parts, 120);
      for (const WorldSpec& world : worlds) EXPECT_EQ(world.global_world, next++);
    }
    EXPECT_EQ(next, all.size());
  }
}

TEST(PartsOfWorlds, HaveAtLeastOneWorld) {
  const std::vector<WorldSpec> all{{0, 1, 0}, {0, 1, 1}, {0, 100, 2}, {0, 1, 3}};
  const size_t expected[] = {2, 1, 1};
  for (int part = 0; part < 3; ++part) EXPECT_EQ(worlds_in_part(all, part, 3).size(), expected[part]) << part;
  for (int part = 0; part < 4; ++part) EXPECT_EQ(worlds_in_part(all, part, 4).size(), 1u);
  EXPECT_THAT(test::message_of([&] { worlds_in_part(all, 0, 5); }), HasSubstr("4 worlds cannot be divided over 5"));
}

// Two maps with traffic lights and parked cars, worlds of several sizes, short episodes: everything in a state.
TEST(PartsOfWorlds, StepAndSaveAsOneSimulatorDoes) {
  SimulatorConfig config;
  config.seed = 5;
  config.episode_steps = 25;
  config.num_threads = 1;
  const std::vector<std::shared_ptr<const RoadMap>> maps{load_map("procedural"), load_map("procedural:7")};
  const std::vector<WorldSpec> all = draw_worlds(config.seed, 60, 2, 12, 2);
  const auto step = [](Simulator* simulator, int from, int to) {
    std::vector<int32_t> actions(static_cast<size_t>(simulator->num_slots()));
    const SlotTable slots = simulator->slots();
    for (int i = from; i < to; ++i) {
      for (size_t slot = 0; slot < actions.size(); ++slot) {
        const auto world = static_cast<size_t>(slots.world_of_slot[slot]);
        actions[slot] = static_cast<int32_t>(
            (7 * slots.global_world[world] + 3 * static_cast<uint32_t>(slots.agent_of_slot[slot]) + uint32_t(i)) %
            kNumActions);
      }
      simulator->step(actions);
    }
  };
  const std::unique_ptr<Simulator> whole = make_simulator("cpu", config, maps, all);
  whole->reset();
  step(whole.get(), 0, 40);
  ASSERT_GT(whole->totals().episodes, 0);

  const std::unique_ptr<Simulator> part = make_simulator("cpu", config, maps, all);
  std::vector<std::vector<uint8_t>> saved;
  for (int i = 0; i < 3; ++i) {
    part->set_worlds(whole->maps(), {}, worlds_in_part(all, i, 3), config.seed);
    step(part.get(), 0, 40);
    saved.push_back(part->save());
  }
  const std::vector<uint8_t> joined = join_saved_states(*part, all, saved);
  EXPECT_EQ(joined, whole->save());

  // The joined state is divided into another number of parts, which continue as the whole does.
  step(whole.get(), 40, 60);
  std::vector<std::vector<uint8_t>> later;
  for (int i = 0; i < 2; ++i) {
    part->set_worlds(whole->maps(), {}, worlds_in_part(all, i, 2), config.seed);
    part->restore(extract_saved_part(*part, all, joined, i, 2));
    step(part.get(), 40, 60);
    later.push_back(part->save());
  }
  EXPECT_EQ(join_saved_states(*whole, all, later), whole->save());

  std::vector<WorldSpec> others = all;
  ++others[0].num_agents;
  EXPECT_THAT(test::message_of([&] { extract_saved_part(*whole, others, joined, 0, 1); }), HasSubstr("worlds"));
}

// Two worlds of different moments in another order, without walls and entity observations.
TEST(KeptWorlds, ContinueExactlyInAnotherSimulator) {
  SimulatorConfig config{.seed = 5, .num_threads = 1, .episode_steps = 100, .reset_inactive_fraction = 2};
  const std::vector<std::shared_ptr<const RoadMap>> maps{load_map("procedural"), load_map("procedural:7")};
  const std::vector<WorldSpec> all{{0, 9, 4}, {1, 12, 5}, {0, 7, 6}};
  const auto whole = make_simulator("cpu", config, maps, all);
  // All agents speed up straight ahead: agents that leave the road halt before they reach a wall.
  const auto step = [](Simulator* simulator, int count) {
    const std::vector<int32_t> actions(static_cast<size_t>(simulator->num_slots()), 3 * kNumLatActions + 1);
    for (int i = 0; i < count; ++i) simulator->step(actions);
  };
  step(whole.get(), 20);
  const auto early = extract_worlds(*whole, whole->save(), {1});
  step(whole.get(), 10);
  const auto late = extract_worlds(*whole, whole->save(), {0, 2});

  config.walls = false;
  config.vector_observations = false;
  const auto other = make_simulator("cpu", config, maps, {all[2], all[1]});
  other->restore(saved_state_of(*other, {late[1].get(), early[0].get()}));
  EXPECT_EQ(other->episode_step()[0], 30);
  EXPECT_EQ(other->episode_step()[1], 20);
  step(whole.get(), 10);
  step(other.get(), 10);
  const auto expect_same = [&](int slot, int other_slot) {
    const AgentStateView a = whole->state(), b = other->state();
#define X(name, type, per_agent, first, comment)                                                                     \
  EXPECT_EQ(std::memcmp(a.name + slot * (per_agent), b.name + other_slot * (per_agent), sizeof(type) * (per_agent)), \
            0)                                                                                                       \
      << #name << " of slot " << slot;
    PICTURA_AGENT_FIELDS(X)
#undef X
  };
  for (int agent = 0; agent < 7; ++agent) expect_same(9 + 12 + agent, agent);
  step(other.get(), 10);  // to step 40, where the whole is
  for (int agent = 0; agent < 12; ++agent) expect_same(9 + agent, 7 + agent);

  EXPECT_THAT(test::message_of([&] { saved_state_of(*other, {late[0].get(), early[0].get()}); }),
              HasSubstr("world 0: expected world 6 with 7 agents on map 0, got world 4 with 9 on map 0"));
  EXPECT_THAT(test::message_of([&] { saved_state_of(*other, {early[0].get()}); }),
              HasSubstr("expected 2 kept worlds, got 1"));
}

}  // namespace
}  // namespace pictura
