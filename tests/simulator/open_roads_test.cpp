// Worlds on roads that end: agents start on the roads, leave where lanes end, and enter again.
#include "pictura/tests/map/open_roads.h"

#include <cmath>
#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/backends/make_controller.h"
#include "pictura/common/error.h"
#include "pictura/map/opendrive/opendrive.h"
#include "pictura/simulator/controllers/lane_keeping.h"
#include "pictura/simulator/rules/enter.h"
#include "pictura/tests/simulator/cpu_simulator.h"
#include "pictura/tests/simulator/stage.h"
#include "pictura/tests/simulator/test_maps.h"
#include "pictura/tests/support/error_message.h"

namespace pictura {
namespace {

using ::testing::HasSubstr;
using testing::make;

std::shared_ptr<const RoadMap> map_of(const std::string& text) {
  return std::make_shared<RoadMap>(parse_opendrive(text, "open.xodr"));
}

bool is(AgentStatus status, const AgentStateView& state, int slot) { return state.status[slot] == status; }

/// Steps a simulator with a controller and calls look(result) after each step.
template <typename Look>
void drive(Simulator* simulator, Controller* controller, int steps, const Look& look) {
  std::vector<Command> commands(static_cast<size_t>(simulator->num_slots()));
  for (int step = 0; step < steps; ++step) {
    controller->act(simulator->arrays(), {}, commands);
    look(simulator->step(Span<const Command>(commands)));
  }
}

template <typename Look>
void drive(Simulator* simulator, const std::string& controller, int steps, const Look& look) {
  drive(simulator, make_controller(controller, *simulator, 1).get(), steps, look);
}

TEST(OpenRoads, AgentsLeaveUnderLaneKeepingAndOthersEnter) {
  struct Case {
    const char* name;
    std::string text;
    int agents;  // few at the crossing, where more agents block each other
  };
  for (const auto& [name, text, agents] :
       {Case{"street", test::open_street(), 12}, Case{"crossing", test::open_crossing(), 4},
        Case{"ramp", test::open_ramp(), 6}}) {
    SCOPED_TRACE(name);
    const auto simulator =
        make(testing::cars({.num_threads = 1, .reset_inactive_fraction = 2}), map_of(text), {{0, agents, 0}});
    drive(simulator.get(), "lane", 600, [](const StepResult&) {});
    const SimulatorTotals& totals = simulator->totals();
    EXPECT_EQ(totals.off_road, 0);
    EXPECT_GT(totals.distance_m, 100 * agents);
    EXPECT_GT(totals.goals_reached, 0);
    const SpawnReport report = simulator->spawn_report();
    EXPECT_EQ(report.asked, agents);
    EXPECT_EQ(report.spawned + report.refused, agents);
    EXPECT_GE(report.left, agents);
    EXPECT_GT(report.entered, agents / 2);
    EXPECT_LE(report.entered, report.left);
    EXPECT_GE(totals.finished_agent_episodes, report.left);
  }
}

/// Cars cannot get round the end of this road, which turns by 2.5 rad within 5 cm. Cars that stopped there once crept
/// over the edge, by millimetres a second.
TEST(OpenRoads, BlockedCarsStandStill) {
  test::RoadText road;
  road.length = 24.1;
  road.geometry =
      test::line_at(0, 0, 0, 0, 24) +
      R"(<geometry s="24" x="24" y="0" hdg="0" length="0.1"><spiral curvStart="100" curvEnd="-100"/></geometry>)";
  road.right = test::lane_of(-1, "driving", 3.5);
  for (const uint64_t seed : {0, 7}) {
    const auto simulator = make({.seed = seed, .num_threads = 1}, map_of(test::file_of(road.text())), {{0, 3, 0}});
    LaneKeepingController controller(*simulator);
    constexpr size_t kOfTenMs = 2'000;  // nodes of searches, at 1 to 4 us each
    drive(simulator.get(), &controller, 900, [&](const StepResult&) {
      for (size_t slot = 0; slot < 3; ++slot) {
        const LaneKeepingAgent* agent = controller.agent(slot);
        EXPECT_LE(agent ? agent->search_nodes() : 0, kOfTenMs);
      }
    });
    EXPECT_GT(simulator->totals().agent_steps, 900);
    EXPECT_EQ(simulator->totals().off_road, 0) << seed;
  }
}

TEST(OpenRoads, EveryControllerDrives) {
  for (const char* name : {"random", "idle", "lane", "idm_lanes"}) {
    const auto simulator = make({.num_threads = 1, .parked_cars = 2}, map_of(test::open_crossing()), {{0, 10, 0}});
    drive(simulator.get(), name, 200, [](const StepResult&) {});
    EXPECT_GT(simulator->totals().agent_steps, 0) << name;
  }
}

/// Expects that the step in which an agent leaves is valid and truncated, and that the slot's next step is invalid.
TEST(OpenRoads, LeavingIsTruncatedAndLaterStepsHaveNoAgent) {
  const auto simulator =
      make(testing::cars({.num_threads = 1, .reset_inactive_fraction = 2}), map_of(test::open_street()), {{0, 8, 0}});
  std::vector<uint8_t> left_before(8, 0);
  int left = 0;
  drive(simulator.get(), "idm_lanes", 600, [&](const StepResult& result) {
    const AgentStateView state = simulator->state();
    for (size_t i = 0; i < left_before.size(); ++i) {
      const int slot = static_cast<int>(i);
      if (left_before[i]) {
        EXPECT_FALSE(result.valid[i] || result.truncated[i] || result.terminated[i]);
        EXPECT_EQ(state.left[i], 0);
      }
      left_before[i] = state.left[i];
      if (!state.left[i]) continue;
      ++left;
      EXPECT_TRUE(result.valid[i]);
      EXPECT_TRUE(result.truncated[i]);
      EXPECT_FALSE(result.terminated[i]);
      EXPECT_TRUE(is(AgentStatus::waiting, state, slot));
      EXPECT_EQ(state.halt_reason[i], 0);
      EXPECT_EQ(simulator->views()[i].ego_agent, slot);
      EXPECT_EQ(simulator->views()[i].origin_m.x, state.x_m[i]);
      const Span<const float> ego = simulator->observations().ego.subspan(i * kEgoFeatures, kEgoFeatures);
      EXPECT_TRUE(std::any_of(ego.begin(), ego.end(), [](float value) { return value != 0; }));
    }
  });
  EXPECT_GT(left, 10);
}

/// Rules of entering by positions alone: 2 m + 2 s v behind the next box on the lane, one agent a step and entry.
TEST(OpenRoads, EnteringAgentsAreInsideTheMapWithRoomAhead) {
  const auto map = map_of(test::open_street());
  const auto simulator = make(testing::cars({.num_threads = 1, .reset_inactive_fraction = 2}), map, {{0, 24, 0}});
  std::vector<int32_t> lives(24, 0);
  int entered = 0;
  drive(simulator.get(), "idm_lanes", 800, [&](const StepResult&) {
    const AgentStateView state = simulator->state();
    std::map<int, int> at_end;
    for (size_t i = 0; i < lives.size(); ++i) {
      const bool begins = state.life[i] != lives[i];
      lives[i] = state.life[i];
      if (!begins) continue;
      ++entered;
      EXPECT_EQ(state.life_step[i], simulator->episode_step()[0]);
      const float east = state.cos_heading[i] > 0 ? 1.0f : -1.0f;
      ++at_end[static_cast<int>(east)];
      const AgentBox& box = simulator->scene().agents[i];
      const float along_m = box.center_m.x * east;
      EXPECT_NEAR(along_m - 0.5f * box.length_m, (east > 0 ? 0 : -300) + kEntryInside_m, 1e-3);
      EXPECT_LE(state.speed_mps[i], kMaxEntry_mps);
      for (size_t j = 0; j < lives.size(); ++j) {
        const AgentBox& other = simulator->scene().agents[j];
        const float gap_m = other.center_m.x * east - 0.5f * other.length_m - along_m - 0.5f * box.length_m;
        if (j == i || !other.drawn || other.cos_heading * east < 0 || gap_m < -box.length_m) continue;
        EXPECT_GE(gap_m, std::min(kEntryGap_m + kEntryHeadway_s * state.speed_mps[i], 17.9f));
      }
    }
    for (const auto& [end, count] : at_end) EXPECT_EQ(count, 1) << end;
  });
  EXPECT_GT(entered, 20);
}

TEST(OpenRoads, InfractionsNeverFreeASlot) {
  const auto simulator =
      make(testing::cars({.num_threads = 1, .reset_inactive_fraction = 2}), map_of(test::open_street()), {{0, 20, 0}});
  std::vector<int32_t> halted(20, -1);
  drive(simulator.get(), "random", 400, [&](const StepResult&) {
    const AgentStateView state = simulator->state();
    for (size_t i = 0; i < halted.size(); ++i) {
      if (halted[i] >= 0) {
        EXPECT_TRUE(is(AgentStatus::halted, state, static_cast<int>(i)));
        EXPECT_EQ(state.life[i], halted[i]);
      } else if (is(AgentStatus::halted, state, static_cast<int>(i))) {
        halted[i] = state.life[i];
      }
    }
  });
  EXPECT_GT(std::count_if(halted.begin(), halted.end(), [](int32_t life) { return life >= 0; }), 5);
}

TEST(OpenRoads, WaypointsEndFiveMetresBeforeTheExit) {
  const MapRules rules = make_map_rules(*map_of(test::open_street()), {});
  ASSERT_TRUE(rules.is_open);
  RandomStream random({.seed = 3, .purpose = Purpose::goals});
  for (int route = 0; route < 50; ++route) {
    RoutePoint at{route % 2, static_cast<float>(route)};
    for (int i = 0; i < 20; ++i) {
      const RoutePoint next = next_waypoint(rules.view(), at, &random);
      EXPECT_EQ(next.lane, at.lane);
      EXPECT_GE(next.s_m, at.s_m);
      EXPECT_LE(next.s_m, 295);
      at = next;
    }
    EXPECT_FLOAT_EQ(at.s_m, 295);
    EXPECT_TRUE(is_at_route_end(rules.view(), at));
  }
}

/// The road under a bumper is several metres higher or lower than under the rear axle.
TEST(OpenRoads, AgentsLeaveSteepRoads) {
  for (const double slope : {-1.0, -0.7, 0.7, 1.0}) {
    test::RoadText road;
    road.elevation = fmt::format(R"(<elevation s="0" a="{}" b="{}" c="0" d="0"/>)", -96 * slope, slope);
    road.right = test::lane_of(-1, "driving", 3.5);
    testing::Stage stage(map_of(test::file_of(road.text())), 1);
    stage.put(0, {96, -1.75f}, 0, 5);
    bool left = false;
    for (int step = 0; step < 3; ++step) {
      stage.step();
      left |= stage.world().agents.left[0] != 0;
    }
    EXPECT_TRUE(left) << slope;
  }
}

TEST(OpenRoads, ExitsOfOtherLevelsHoldNoAgent) {
  test::RoadText below, above;
  below.right = above.right = test::lane_of(-1, "driving", 3.5);
  above.id = "2";
  above.length = 50;
  above.elevation = R"(<elevation s="0" a="3" b="0" c="0" d="0"/>)";
  testing::Stage stage(map_of(test::file_of(below.text() + above.text())), 1);
  stage.put(0, {40, -1.75f}, 0, 10);
  for (int step = 0; step < 20; ++step) {
    stage.step();
    EXPECT_FALSE(stage.world().agents.left[0]);
  }
  EXPECT_GT(stage.world().agents.x_m[0], 55);
}

TEST(OpenRoads, AgentsStartWithRoadAhead) {
  const auto simulator = make(testing::cars(), map_of(test::open_street(30)), {{0, 20, 0}});
  const SpawnReport report = simulator->spawn_report();
  EXPECT_GT(report.spawned, 0);
  for (size_t i = 0; i < 20; ++i) {
    if (!is(AgentStatus::active, simulator->state(), static_cast<int>(i))) continue;
    const float x_m = simulator->state().x_m[i];
    EXPECT_LE(simulator->state().cos_heading[i] > 0 ? x_m : 30 - x_m, 10 + 1e-3);
  }
  EXPECT_THAT(test::message_of([] { make(testing::cars(), map_of(test::open_street(19)), {{0, 1, 0}}); }),
              HasSubstr("expected a driving or ramp lane with more than 20 m of way ahead"));
}

TEST(OpenRoads, ThreadsAndOtherWorldsChangeNothing) {
  const std::vector<WorldSpec> worlds{{0, 8, 0}, {0, 5, 1}, {0, 12, 2}};
  const auto map = map_of(test::open_crossing());
  uint64_t hash[2];
  for (const int threads : {1, 2}) {
    const auto simulator = make({.num_threads = threads, .parked_cars = 2}, map, worlds);
    drive(simulator.get(), "idm_lanes", 300, [](const StepResult&) {});
    EXPECT_GT(simulator->spawn_report().entered, 0);
    hash[threads - 1] = simulator->state_hash();
  }
  EXPECT_EQ(hash[0], hash[1]);
}

TEST(OpenRoads, StatesAreSavedWithTheirLives) {
  const SimulatorConfig config = testing::cars({.num_threads = 1, .reset_inactive_fraction = 2});
  const auto map = map_of(test::open_street());
  const auto simulator = make(config, map, {{0, 8, 0}}), other = make(config, map, {{0, 8, 0}});
  drive(simulator.get(), "idm_lanes", 400, [](const StepResult&) {});
  ASSERT_GT(simulator->spawn_report().entered, 0);
  other->restore(simulator->save());
  EXPECT_EQ(simulator->state_hash(), other->state_hash());
  for (int step = 0; step < 100; ++step) {
    simulator->step(testing::mixed_actions(8, static_cast<uint32_t>(step)));
    other->step(testing::mixed_actions(8, static_cast<uint32_t>(step)));
  }
  EXPECT_EQ(simulator->state_hash(), other->state_hash());
  EXPECT_EQ(simulator->spawn_report().left, other->spawn_report().left);
}

}  // namespace
}  // namespace pictura
