#include "pictura/simulator/rules/goal.h"

#include <cmath>

#include <gtest/gtest.h>

#include "pictura/tests/simulator/stage.h"
#include "pictura/tests/simulator/test_maps.h"

namespace pictura {
namespace {

/// Arc length along the outermost lane of stadium(200, .), from x = 0 of the southern straight.
double arc_length(const RoutePoint& at, double straight_m, double arc_m) {
  const int part = at.lane % 4;
  return at.s_m + (part >= 1 ? straight_m : 0) + (part >= 2 ? arc_m : 0) + (part >= 3 ? straight_m : 0);
}

TEST(Goal, WaypointsLie20To60MetresApartAlongTheRoute) {
  const MapRules map = make_map_rules(*testing::stadium(200, 1), {});
  const double arc_m = map.lanes[1].length_m, lap_m = 400 + 2 * arc_m;
  RandomStream random({.seed = 3, .purpose = Purpose::goals});
  RoutePoint at{0, 10};
  double shortest = 1e9, longest = 0;
  for (int i = 0; i < 500; ++i) {
    const RoutePoint next = next_waypoint(map.view(), at, &random);
    const double gap = std::fmod(arc_length(next, 200, arc_m) - arc_length(at, 200, arc_m) + lap_m, lap_m);
    shortest = std::min(shortest, gap);
    longest = std::max(longest, gap);
    at = next;
  }
  EXPECT_GE(shortest, 20 - 1e-3);
  EXPECT_LE(longest, 60 + 1e-3);
  EXPECT_LT(shortest, 22);
  EXPECT_GT(longest, 58);
}

TEST(Goal, AQuarterOfTheWaypointsChangesLanes) {
  const MapRules map = make_map_rules(*testing::stadium(200, 2), {});
  RandomStream random({.seed = 3, .purpose = Purpose::goals});
  RoutePoint at{0, 10};
  int changes = 0;
  constexpr int kWaypoints = 4000;
  for (int i = 0; i < kWaypoints; ++i) {
    const RoutePoint next = next_waypoint(map.view(), at, &random);
    changes += next.lane / 4 != at.lane / 4;
    at = next;
  }
  // Only one of the two sides that a lane change may go to has a lane.
  EXPECT_NEAR(changes / double{kWaypoints}, 0.125, 0.02);
}

TEST(Goal, RoutesLeaveAnEndingLaneForTheNearestContinuingLane) {
  // Only the innermost of the southern straight's three lanes continues.
  auto map = testing::stadium(200, 3);
  for (const size_t lane : {0u, 4u}) map->lanes[lane].successors = {};
  const MapRules rules = make_map_rules(*map, {});
  const MapView view = rules.view();
  EXPECT_EQ(through_lane(view, {0, 50}).lane, 8);
  EXPECT_EQ(through_lane(view, {4, 50}).lane, 8);
  EXPECT_EQ(through_lane(view, {8, 50}).lane, 8);
  EXPECT_FLOAT_EQ(through_lane(view, {0, 50}).s_m, 50);
  RandomStream random({.seed = 3, .purpose = Purpose::goals});
  const RoutePoint at = advance_along_lanes(view, {0, 190}, 30, &random);
  EXPECT_EQ(at.lane, 9);
  EXPECT_NEAR(at.s_m, 20, 1e-3);
}

TEST(Goal, RoutesAvoidDeadEnds) {
  // The right lane of the northern straight ends: the route must have changed to the left one.
  auto map = testing::stadium(200, 2);
  map->lanes[1].is_endless = true;
  map->lanes[2].successors = {};
  map->lanes[3].is_endless = false;
  const MapRules world_map = make_map_rules(*map, {});
  RandomStream random({.seed = 3, .purpose = Purpose::goals});
  RoutePoint at{2, 150};
  for (int i = 0; i < 200; ++i) {
    at = next_waypoint(world_map.view(), at, &random);
    EXPECT_NE(at.lane, 3);
  }
}

TEST(Goal, PassingFollowsThePathOnItsLevel) {
  EXPECT_TRUE(passes({0, 0, 0}, {4, 0, 0}, {2, 1.9f, 0}, 2));
  EXPECT_FALSE(passes({0, 0, 0}, {4, 0, 0}, {2, 2.1f, 0}, 2));
  EXPECT_FALSE(passes({0, 0, 0}, {4, 0, 0}, {6.1f, 0, 0}, 2));
  EXPECT_TRUE(passes({0, 0, 0}, {0, 0, 0}, {1, 1, 3.9f}, 2));
  EXPECT_FALSE(passes({0, 0, 0}, {0, 0, 0}, {1, 1, 4}, 2));
}

struct GoalChain : ::testing::Test {
  GoalChain() : stage(testing::stadium(400, 1), 1) {
    stage.put(0, {50, 0}, 0, 10);
    stage.set(0, Conditioning::delta_goal_m, 2);
    stage.set(0, Conditioning::v_goal_mps, 20);
    set_waypoints({60, 90, 120});
  }
  void set_waypoints(std::array<float, 3> x_m) {
    AgentState& agents = stage.worlds.state.agents;
    for (size_t i = 0; i < 3; ++i) {
      agents.waypoint_x_m[i] = x_m[i];
      agents.waypoint_y_m[i] = agents.waypoint_z_m[i] = 0;
    }
    agents.next_waypoint[0] = 0;
    agents.goal_lane[0] = 0;
    agents.goal_lane_s_m[0] = x_m[2];
  }
  /// Steps until an event includes `bit`; returns x of the rear axle then.
  float drive_until(int bit) {
    for (int i = 0; i < 200; ++i) {
      reward = stage.step()[0];
      if (stage.events(0) & bit) return stage.worlds.state.agents.x_m[0];
    }
    return NAN;
  }

  testing::Stage stage;
  float reward = 0;
};

TEST_F(GoalChain, AdvancesAndRenews) {
  EXPECT_NEAR(drive_until(kEventWaypoint), 59, 0.01);
  EXPECT_NEAR(reward, 1, 1e-3);
  EXPECT_EQ(stage.worlds.state.agents.next_waypoint[0], 1);
  EXPECT_NEAR(drive_until(kEventWaypoint), 89, 0.01);
  EXPECT_EQ(stage.worlds.state.agents.goal_x_m[0], 120);
  EXPECT_NEAR(drive_until(kEventGoal), 119, 0.01);
  EXPECT_NEAR(reward, 1, 1e-3);
  EXPECT_EQ(stage.events(0), kEventGoal | kEventMetricGoal);
  EXPECT_EQ(stage.worlds.state.agents.goals_reached[0], 1);
  EXPECT_EQ(stage.worlds.state.agents.waypoints_reached[0], 3);
  EXPECT_EQ(stage.worlds.state.agents.next_waypoint[0], 0);
  // The new chain starts where the old one ended, at x = 120.
  EXPECT_GE(stage.worlds.state.agents.waypoint_x_m[0], 140 - 0.01);
  EXPECT_LE(stage.worlds.state.agents.waypoint_x_m[0], 180 + 0.01);
  EXPECT_NEAR(stage.worlds.state.agents.waypoint_y_m[0], 0, 1e-4);
}

TEST_F(GoalChain, TheLastWaypointIsRewardedOnlyBelowItsSpeedButAdvances) {
  stage.set(0, Conditioning::v_goal_mps, 5);
  drive_until(kEventWaypoint);
  drive_until(kEventWaypoint);
  EXPECT_NEAR(drive_until(kEventGoal), 119, 0.01);
  EXPECT_NEAR(reward, 0, 1e-3);
  EXPECT_EQ(stage.worlds.state.agents.goals_reached[0], 1);
}

TEST_F(GoalChain, TheMetricCountsArrivalForAWideRewardRadius) {
  stage.set(0, Conditioning::delta_goal_m, 12);
  drive_until(kEventWaypoint);
  drive_until(kEventWaypoint);
  EXPECT_NEAR(drive_until(kEventGoal), 109, 0.01);  // paid 12 m ahead: the waypoints are renewed
  EXPECT_EQ(stage.worlds.state.agents.goals_reached[0], 0);
  EXPECT_NEAR(drive_until(kEventMetricGoal), 119, 0.01);  // counted when the agent arrives
  EXPECT_EQ(stage.worlds.state.agents.goals_reached[0], 1);
  EXPECT_EQ(stage.worlds.state.agents.goal_open[0], 0);
}

TEST_F(GoalChain, TheMetricCountsEachChainOnce) {
  stage.set(0, Conditioning::delta_goal_m, 0.5f);
  drive_until(kEventWaypoint);
  drive_until(kEventWaypoint);
  drive_until(kEventMetricGoal);
  drive_until(kEventGoal);
  for (int i = 0; i < 5; ++i) stage.step();
  EXPECT_EQ(stage.worlds.state.agents.goals_reached[0], 1);
}

}  // namespace
}  // namespace pictura
