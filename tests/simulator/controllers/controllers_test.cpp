// Controllers and the commands that they write: the random and the idle controller, kinematic states, and absence.
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/backends/make_controller.h"
#include "pictura/common/error.h"
#include "pictura/simulator/rules/control.h"
#include "pictura/tests/simulator/cpu_simulator.h"
#include "pictura/tests/simulator/same_bits.h"
#include "pictura/tests/simulator/test_maps.h"
#include "pictura/tests/support/error_message.h"

namespace pictura {
namespace {

using ::testing::HasSubstr;
using testing::make;

Command absence() {
  Command command;
  command.kind = CommandKind::absent;
  return command;
}

/// Returns a command that moves the agent from its own pose.
Command moved(const AgentStateView& state, int slot, float ahead_m, float speed_mps) {
  Command command;
  command.kind = CommandKind::kinematic_state;
  command.x_m = state.x_m[slot] + ahead_m * state.cos_heading[slot];
  command.y_m = state.y_m[slot] + ahead_m * state.sin_heading[slot];
  command.z_m = state.z_m[slot];
  command.heading_rad = state.heading_rad[slot];
  command.speed_mps = speed_mps;
  return command;
}

TEST(Controller, RandomActionsAreKeyedByWorldAgentAndStep) {
  const auto simulator = make(testing::cars({.episode_steps = 3}), testing::stadium(200, 2), {{0, 5, 7}, {0, 40, 2}});
  const auto controller = make_controller("random", *simulator, 11);
  std::vector<Command> commands(45);
  for (uint32_t step = 0; step < 10; ++step) {
    controller->act(simulator->arrays(), {}, commands);
    for (uint32_t slot = 0; slot < 45; ++slot) {
      const uint32_t world = slot < 5 ? 7 : 2, agent = slot < 5 ? slot : slot - 5;
      RandomStream random({.seed = 11, .world = world, .agent = agent, .step = step, .purpose = Purpose::action});
      ASSERT_EQ(commands[slot].kind, CommandKind::action);
      ASSERT_EQ(commands[slot].action, random.below(kNumActions)) << "step " << step << ", slot " << slot;
    }
    simulator->step(commands);
  }
  EXPECT_GT(simulator->totals().episodes, 0) << "steps go on over episodes";
}

// Random actions differ between slots. Slots 0 and 4,096 once drew alike, when actions were keyed by slot.
TEST(Controller, RandomActionsOfManySlotsDiffer) {
  const auto simulator =
      make(testing::cars({.vector_observations = false}), testing::stadium(1500, 2), {{0, 4090, 0}, {0, 100, 1}});
  const auto controller = make_controller("random", *simulator, 11);
  std::vector<Command> commands(4190);
  int alike = 0;
  for (int step = 0; step < 20; ++step) {
    controller->act(simulator->arrays(), {}, commands);
    for (size_t slot = 0; slot + 4096 < commands.size(); ++slot) {
      alike += commands[slot].action == commands[slot + 4096].action;
    }
    simulator->step(commands);
  }
  EXPECT_NEAR(alike, 20 * 94 / 12.0, 60);
}

TEST(Controller, RandomActionsContinueWithARestoredSimulator) {
  const SimulatorConfig config = testing::cars({.episode_steps = 30});
  const std::vector<WorldSpec> worlds{{0, 20, 0}};
  const auto first = make(config, testing::stadium(200, 2), worlds);
  const auto drive = [](Simulator* simulator, int steps) {
    const auto controller = make_controller("random", *simulator, 3);
    std::vector<Command> commands(20);
    for (int step = 0; step < steps; ++step) {
      controller->act(simulator->arrays(), {}, commands);
      simulator->step(commands);
    }
  };
  drive(first.get(), 40);
  const auto second = make(config, testing::stadium(200, 2), worlds);
  second->restore(first->save());
  drive(first.get(), 40);
  drive(second.get(), 40);
  EXPECT_EQ(first->state_hash(), second->state_hash());
}

TEST(Controller, AMaskSharesASimulator) {
  const auto simulator = make(testing::cars(), testing::stadium(200, 2), {{0, 4, 0}});
  std::vector<Command> commands(4, absence());
  make_controller("idle", *simulator, 0)->act(simulator->arrays(), std::vector<uint8_t>{1, 0, 0, 1}, commands);
  EXPECT_EQ(commands[0].kind, CommandKind::action);
  EXPECT_EQ(commands[0].action, kIdleAction);
  EXPECT_EQ(commands[1].kind, CommandKind::absent);
  EXPECT_EQ(commands[2].kind, CommandKind::absent);
  EXPECT_EQ(commands[3].kind, CommandKind::action);
}

TEST(Controller, RefusesArraysOfAnotherSizeAndUnknownNames) {
  const auto simulator = make(testing::cars(), testing::stadium(200, 2), {{0, 4, 0}});
  std::vector<Command> commands(3);
  const auto controller = make_controller("random", *simulator, 0);
  EXPECT_THAT(test::message_of([&] { controller->act(simulator->arrays(), {}, commands); }),
              HasSubstr("controller random: expected memory for 4 commands, got 3"));
  commands.resize(4);
  EXPECT_THAT(test::message_of([&] { controller->act(simulator->arrays(), std::vector<uint8_t>(5, 1), commands); }),
              HasSubstr("expected a mask of 4 slots, got 5"));
  EXPECT_THAT(test::message_of<UsageError>([&] { make_controller("pilot", *simulator, 0); }),
              HasSubstr("expected one of random, idle, lane, idm_lanes, log, inverse, idm; got 'pilot'"));
}

TEST(Controller, LaneKeepingNeedsTheEpisodesFirstStep) {
  const auto simulator = make(testing::cars({.episode_steps = 20}), testing::stadium(200, 2), {{0, 3, 0}});
  const auto controller = make_controller("lane", *simulator, 0);
  std::vector<Command> commands(3);
  for (int step = 0; step < 50; ++step) {  // passes the ends of two episodes
    controller->act(simulator->arrays(), {}, commands);
    simulator->step(commands);
  }
  EXPECT_EQ(simulator->totals().collisions + simulator->totals().off_road, 0);
  const auto late = make_controller("lane", *simulator, 0);
  EXPECT_THAT(test::message_of([&] { late->act(simulator->arrays(), {}, commands); }),
              HasSubstr("expected to act from the first step of episode"));
}

TEST(Commands, ActionCommandsEqualActions) {
  const auto a = make(testing::cars(), testing::stadium(200, 2), {{0, 30, 0}, {0, 10, 1}});
  const auto b = make(testing::cars(), testing::stadium(200, 2), {{0, 30, 0}, {0, 10, 1}});
  for (uint32_t step = 0; step < 100; ++step) {
    const std::vector<int32_t> actions = testing::mixed_actions(40, step);
    std::vector<Command> commands(40);
    for (size_t slot = 0; slot < 40; ++slot) commands[slot].action = actions[slot];
    a->step(actions);
    b->step(commands);
  }
  EXPECT_EQ(a->save(), b->save());
}

TEST(Commands, AKinematicStateSetsTheNextPose) {
  const auto simulator = make(testing::cars(), testing::stadium(200, 2), {{0, 2, 0}});
  const AgentStateView state = simulator->state();
  std::vector<Command> commands(2);
  commands[1] = moved(state, 1, 1.5f, 15);
  commands[1].heading_rad += 2 * kTwoPi;
  const float wrapped = wrap_angle(commands[1].heading_rad);
  const StepResult result = simulator->step(commands);
  EXPECT_EQ(state.x_m[1], commands[1].x_m);
  EXPECT_EQ(state.y_m[1], commands[1].y_m);
  EXPECT_EQ(state.heading_rad[1], wrapped);
  EXPECT_EQ(state.speed_mps[1], 15);
  EXPECT_EQ(state.accel_long_mps2[1], 0);
  EXPECT_EQ(state.distance_m[1], 1.5f);
  EXPECT_EQ(state.events[1] & kInfractions, 0);
  EXPECT_EQ(result.valid[1], 1);
  EXPECT_EQ(simulator->views()[1].origin_m.x, commands[1].x_m);
  EXPECT_NEAR(simulator->observations().ego[kEgoFeatures], 15 / 20.0f, 1e-6f);
}

TEST(Commands, KinematicStatesHaveEvents) {
  const auto simulator = make(testing::cars(), testing::stadium(200, 2), {{0, 3, 0}});
  const AgentStateView state = simulator->state();
  std::vector<Command> commands(3);
  commands[0] = moved(state, 0, 0, 0);
  commands[0].x_m += 1000;  // off the map
  commands[1] = moved(state, 2, 0.5f, 5);
  const StepResult result = simulator->step(commands);
  EXPECT_TRUE(state.events[0] & kEventOffRoad);
  EXPECT_TRUE(state.events[1] & kEventCollision);
  EXPECT_TRUE(state.events[2] & kEventCollision);
  EXPECT_EQ(result.terminated[0] + result.terminated[1] + result.terminated[2], 3);

  const auto second = make(testing::cars(), testing::stadium(200, 2), {{0, 1, 0}});
  Command to_waypoint;
  to_waypoint.kind = CommandKind::kinematic_state;
  to_waypoint.x_m = second->state().waypoint_x_m[0];
  to_waypoint.y_m = second->state().waypoint_y_m[0];
  to_waypoint.heading_rad = second->state().heading_rad[0];
  second->step(std::vector<Command>{to_waypoint});
  EXPECT_TRUE(second->state().events[0] & kEventWaypoint);
}

TEST(Commands, AbsentAgentsLeaveTheirEpisode) {
  const auto simulator = make(testing::cars({.reset_inactive_fraction = 2}), testing::stadium(200, 2), {{0, 3, 0}});
  std::vector<Command> commands(3);
  commands[1] = absence();
  StepResult result = simulator->step(commands);
  EXPECT_EQ(simulator->state().status[1], AgentStatus::absent);
  EXPECT_EQ(simulator->scene().agents[1].drawn, 0);
  EXPECT_EQ(simulator->views()[1].ego_agent, -1);
  EXPECT_EQ(result.valid[1], 0);
  EXPECT_EQ(result.terminated[1] + result.truncated[1], 0);
  EXPECT_EQ(simulator->totals().agent_steps, 2);
  // Another agent may stand at the removed agent's place. Commands to the absent agent have no effect.
  commands[0] = moved(simulator->state(), 1, 0, 0);
  commands[1].kind = static_cast<CommandKind>(9);
  result = simulator->step(commands);
  EXPECT_EQ(simulator->state().events[0] & kEventCollision, 0);
  EXPECT_EQ(result.valid[1], 0);
  // A saved state holds absent agents.
  const auto other = make(testing::cars({.reset_inactive_fraction = 2}), testing::stadium(200, 2), {{0, 3, 0}});
  EXPECT_NO_THROW(other->restore(simulator->save()));
  simulator->reset();
  EXPECT_EQ(simulator->state().status[1], AgentStatus::active);
}

TEST(Commands, ErrorsNameCommandsOutOfRangeAndChangeNothing) {
  const auto simulator = make(testing::cars(), testing::stadium(200, 2), {{0, 4, 0}});
  const uint64_t before = simulator->state_hash();
  std::vector<Command> commands(4);
  const auto refusal = [&](const Command& bad) {
    commands[3] = bad;
    const std::string message = test::message_of([&] { simulator->step(commands); });
    EXPECT_EQ(simulator->state_hash(), before);
    return message;
  };
  Command action;
  action.action = kNumActions;
  EXPECT_THAT(refusal(action), HasSubstr("slot 3: expected an action in [0, 12), got 12"));
  for (float Command::* member :
       {&Command::x_m, &Command::y_m, &Command::z_m, &Command::heading_rad, &Command::speed_mps}) {
    for (const float value : {NAN, INFINITY, -1e7f}) {
      Command state = moved(simulator->state(), 3, 0, 0);
      state.*member = value;
      EXPECT_THAT(refusal(state), HasSubstr("slot 3: expected a kinematic state within"));
    }
  }
  Command unknown;
  unknown.kind = static_cast<CommandKind>(7);
  EXPECT_THAT(refusal(unknown),
              HasSubstr("slot 3: expected a command that is an action, a kinematic state, absence or the record"));
  EXPECT_THAT(test::message_of([&] { simulator->step(std::vector<Command>(3)); }),
              HasSubstr("expected 4 commands, got 3"));
}

}  // namespace
}  // namespace pictura
