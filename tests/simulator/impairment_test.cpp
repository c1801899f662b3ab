// Impaired agents: their number, when impairments are active, what the agents miss and do, and how they are counted.
#include "pictura/simulator/rules/impairment.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/backends/make_simulator.h"
#include "pictura/map/load_map.h"
#include "pictura/simulator/observation.h"
#include "pictura/tests/simulator/cpu_simulator.h"
#include "pictura/tests/simulator/same_bits.h"
#include "pictura/tests/simulator/test_maps.h"
#include "pictura/tests/support/error_message.h"

namespace pictura {
namespace {

using ::testing::HasSubstr;

constexpr OtherShares kMixed{.blind = 0.3f, .phantom_braking = 0.3f, .inattentive = 0.3f};

Impairment impairment_of_slot(const Simulator& simulator, int slot) {
  const SlotTable& slots = simulator.slots();
  const int32_t world = slots.world_of_slot[slot];
  return draw_impairment(simulator.config().others, simulator.arrays().seed[world], slots.global_world[world],
                         static_cast<uint32_t>(slots.agent_of_slot[slot]),
                         static_cast<uint32_t>(simulator.episode_index()[world]));
}

/// Returns the impairment of a slot's agent if it is active now.
Impairment active_impairment_of_slot(const Simulator& simulator, int slot) {
  const SlotTable& slots = simulator.slots();
  const int32_t world = slots.world_of_slot[slot];
  const Impairment impairment = impairment_of_slot(simulator, slot);
  const bool shows =
      is_active_at(impairment, simulator.episode_step()[world], simulator.config().dt_s, simulator.arrays().seed[world],
                   slots.global_world[world], static_cast<uint32_t>(slots.agent_of_slot[slot]),
                   static_cast<uint32_t>(simulator.episode_index()[world]));
  return shows ? impairment : Impairment::none;
}

int32_t count_of(const Simulator& simulator, int slot, EntitySet set) {
  return simulator.observations().set_counts[slot * kNumEntitySets + static_cast<int>(set)];
}

TEST(Impairment, IsDrawnPerAgentAndEpisodeByItsShares) {
  constexpr int kAgents = 20000;
  const OtherShares shares{.blind = 0.05f, .phantom_braking = 0.1f, .inattentive = 0.2f};
  std::array<int, 4> counts{};
  int changed = 0;
  for (int i = 0; i < kAgents; ++i) {
    const auto world = static_cast<uint32_t>(i / 100), agent = static_cast<uint32_t>(i % 100);
    const Impairment first = draw_impairment(shares, 7, world, agent, 0);
    ++counts[static_cast<size_t>(first)];
    changed += first != draw_impairment(shares, 7, world, agent, 1);
    EXPECT_EQ(draw_impairment({}, 7, world, agent, 0), Impairment::none);
  }
  constexpr double kTolerance = 0.01;  // more than three standard deviations
  EXPECT_NEAR(counts[1] / double{kAgents}, 0.05, kTolerance);
  EXPECT_NEAR(counts[2] / double{kAgents}, 0.1, kTolerance);
  EXPECT_NEAR(counts[3] / double{kAgents}, 0.2, kTolerance);
  EXPECT_NEAR(changed / double{kAgents}, 1 - (0.05 * 0.05 + 0.1 * 0.1 + 0.2 * 0.2 + 0.65 * 0.65), 2 * kTolerance);
}

TEST(Impairment, IsActiveOnceInEveryTenSeconds) {
  for (const float dt_s : {0.1f, 0.05f}) {
    const int period_steps = static_cast<int>(10 / dt_s + 0.5f);
    int shown = 0, begun_at_once = 0;
    constexpr int kSpells = 500;
    for (int spell = 0; spell < kSpells; ++spell) {
      int steps = 0, begins = 0;
      bool showed = false;
      for (int step = 0; step < period_steps; ++step) {
        const bool shows = is_active_at(Impairment::blind, spell * period_steps + step, dt_s, 3, 1, 2, 0);
        steps += shows;
        begins += shows && !showed;
        begun_at_once += shows && step == 0;
        showed = shows;
      }
      EXPECT_EQ(begins, 1) << spell;
      EXPECT_GE(steps, period_steps / 10);
      EXPECT_LE(steps, period_steps / 2);
      shown += steps;
    }
    EXPECT_NEAR(shown / double(kSpells * period_steps), 0.3, 0.02);
    EXPECT_LT(begun_at_once, kSpells / 10);
  }
  EXPECT_TRUE(is_active_at(Impairment::inattentive, 1234, 0.1f, 3, 1, 2, 0));
  EXPECT_FALSE(is_active_at(Impairment::none, 1234, 0.1f, 3, 1, 2, 0));
}

TEST(Impairment, HidesOnlyRoadUsersOrLightsFromListsAndImages) {
  SimulatorConfig config{.pedestrian_fraction = 0.2f, .cyclist_fraction = 0.2f, .parked_cars = 30};
  config.after_infraction = AfterInfraction::drive_on;
  config.reset_inactive_fraction = 2;
  const auto map = load_map("procedural:1");
  const std::vector<WorldSpec> worlds{{0, 60, 0}, {0, 60, 1}};
  config.others = {.blind = 0.4f, .inattentive = 0.4f};
  const auto impaired = testing::make(config, map, worlds);
  config.others = {};
  const auto plain = testing::make(config, map, worlds);
  std::array<int, 4> missed{};  // by impairment: sets that unimpaired agents observe
  for (uint32_t step = 0; step < 150; ++step) {
    // The other observations have no effect here, because the actions are the same.
    ASSERT_TRUE(testing::same_bits(impaired->scene().agents, plain->scene().agents)) << step;
    for (int slot = 0; slot < plain->num_slots(); ++slot) {
      const Impairment shown = active_impairment_of_slot(*impaired, slot);
      const bool is_present = plain->views()[slot].ego_agent >= 0;
      EXPECT_EQ(impaired->views()[slot].hides, is_present ? hidden_by(shown) : kHidesNothing);
      EXPECT_EQ(plain->views()[slot].hides, kHidesNothing);
      for (const EntitySet set : {EntitySet::partners, EntitySet::lanes, EntitySet::boundaries, EntitySet::controls}) {
        const bool is_missed = (shown == Impairment::blind && set == EntitySet::partners) ||
                               (shown == Impairment::inattentive && set == EntitySet::controls);
        const int32_t there = count_of(*plain, slot, set);
        EXPECT_EQ(count_of(*impaired, slot, set), is_missed ? 0 : there);
        missed[static_cast<size_t>(shown)] += is_missed && there > 0;
      }
    }
    impaired->step(testing::mixed_actions(plain->num_slots(), step));
    plain->step(testing::mixed_actions(plain->num_slots(), step));
  }
  EXPECT_GT(missed[static_cast<size_t>(Impairment::blind)], 100);
  EXPECT_GT(missed[static_cast<size_t>(Impairment::inattentive)], 100);
  EXPECT_EQ(missed[0], 0);
}

TEST(Impairment, PhantomBrakingEndsAtRestAndNeverTurnsBack) {
  constexpr int kAgents = 30;
  SimulatorConfig config = testing::cars({.reset_inactive_fraction = 2});
  config.after_infraction = AfterInfraction::drive_on;
  config.others = {.phantom_braking = 0.6f};
  const auto simulator = testing::make(config, testing::stadium(2000, 2), {{0, kAgents, 0}});
  constexpr int32_t kFullThrottle = 3 * kNumLatActions + 1;
  const std::vector<int32_t> actions(kAgents, kFullThrottle);
  int braked = 0, rested = 0, faster = 0;
  for (int step = 0; step < 300; ++step) {
    std::array<Impairment, kAgents> shown;
    std::array<float, kAgents> speed_mps, accel_mps2;
    for (int slot = 0; slot < kAgents; ++slot) shown[slot] = active_impairment_of_slot(*simulator, slot);
    std::copy_n(simulator->state().speed_mps, kAgents, speed_mps.begin());
    std::copy_n(simulator->state().accel_long_mps2, kAgents, accel_mps2.begin());
    simulator->step(actions);
    for (int slot = 0; slot < kAgents; ++slot) {
      const float before = speed_mps[slot], after = simulator->state().speed_mps[slot];
      if (shown[slot] == Impairment::none) {
        faster += after > before;
      } else if (before == 0 && accel_mps2[slot] == 0) {
        EXPECT_EQ(after, 0) << slot;
        ++rested;
      } else {
        EXPECT_GE(before * after, 0) << slot;
        // The agent brakes once its acceleration has ended.
        const bool brakes = before * accel_mps2[slot] < 0;
        EXPECT_LE(std::abs(after), brakes ? std::abs(before) : 20) << slot;
        braked += brakes;
      }
    }
  }
  EXPECT_GT(braked, 200);
  EXPECT_GT(rested, 100);
  EXPECT_GT(faster, 1000);
}

TEST(Impairment, ImpairedAgentsAreNeitherValidNorCounted) {
  SimulatorConfig config;
  config.episode_steps = 60;
  config.others = kMixed;
  const auto simulator = testing::make(config, load_map("procedural:1"), draw_worlds(3, 200, 1, 40, 1));
  int64_t valid = 0, impaired = 0, ended = 0, goals = 0, halted = 0;
  double reward = 0;
  for (uint32_t step = 0; step < 150; ++step) {
    std::vector<Impairment> impairments;
    std::vector<bool> acts;
    for (int slot = 0; slot < simulator->num_slots(); ++slot) {
      const int32_t world = simulator->slots().world_of_slot[slot];
      impairments.push_back(impairment_of_slot(*simulator, slot));
      acts.push_back(simulator->state().status[slot] == AgentStatus::active && !simulator->episode_over()[world]);
    }
    const StepResult result = simulator->step(testing::mixed_actions(simulator->num_slots(), step));
    for (int slot = 0; slot < simulator->num_slots(); ++slot) {
      const bool counts = acts[slot] && impairments[slot] == Impairment::none;
      ASSERT_EQ(result.valid[slot], counts) << "step " << step << ", slot " << slot;
      valid += counts;
      impaired += acts[slot] && !counts;
      halted += acts[slot] && !counts && simulator->state().status[slot] == AgentStatus::halted;
      ended += result.terminated[slot] || result.truncated[slot];
      if (!counts) {
        EXPECT_FALSE(result.terminated[slot] || result.truncated[slot]);
        EXPECT_EQ(result.reward[slot], 0);
        EXPECT_EQ(result.sums[slot].distance_m, 0);
        continue;
      }
      goals += (simulator->state().events[slot] & kEventMetricGoal) != 0;
      reward += static_cast<double>(result.reward[slot]);
    }
  }
  const SimulatorTotals totals = simulator->totals();
  EXPECT_EQ(totals.agent_steps, valid);
  EXPECT_EQ(totals.finished_agent_episodes, ended);
  EXPECT_EQ(totals.goals_reached, goals);
  EXPECT_NEAR(totals.reward, reward, 1e-6 * std::abs(reward));
  EXPECT_NEAR(static_cast<double>(impaired) / static_cast<double>(valid + impaired), 0.9, 0.05);
  EXPECT_GT(halted, 10) << "impaired agents halt as all do, and stay in everybody's way";
}

TEST(Impairment, ContinuesExactlyFromASavedState) {
  SimulatorConfig config;
  config.episode_steps = 70;
  config.others = kMixed;
  const auto map = load_map("procedural:1");
  const std::vector<WorldSpec> worlds = draw_worlds(3, 80, 1, 40, 1);
  const auto simulator = testing::make(config, map, worlds), copy = testing::make(config, map, worlds);
  testing::run(simulator.get(), 40);
  copy->restore(simulator->save());
  EXPECT_TRUE(testing::same_bits(copy->views(), simulator->views()));
  testing::run(simulator.get(), 60, 40);
  testing::run(copy.get(), 60, 40);
  EXPECT_EQ(copy->save(), simulator->save());
  config.others.blind = 0;
  const auto other = testing::make(config, map, worlds);
  EXPECT_THAT(test::message_of([&] { other->restore(simulator->save()); }), HasSubstr("others"));
}

TEST(Impairment, SharesSumToLessThanOne) {
  const auto message = [](const OtherShares& shares) {
    SimulatorConfig config = testing::cars();
    config.others = shares;
    return test::message_of([&] { testing::make(config, testing::ring_road(40), {{0, 1, 0}}); });
  };
  EXPECT_EQ(message({.blind = 0.5f, .phantom_braking = 0.3f, .inattentive = 0.1f}), test::kNoError);
  for (const OtherShares& shares : {OtherShares{.blind = 0.5f, .phantom_braking = 0.5f},
                                    OtherShares{.inattentive = -0.1f}, OtherShares{.phantom_braking = 1.5f}}) {
    EXPECT_THAT(message(shares), HasSubstr("simulator: others: expected shares that sum to less than 1, got blind"));
  }
}

}  // namespace
}  // namespace pictura
