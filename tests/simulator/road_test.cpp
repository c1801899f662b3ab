#include "pictura/simulator/rules/road.h"

#include <cmath>

#include <gtest/gtest.h>

#include "pictura/tests/simulator/stage.h"
#include "pictura/tests/simulator/test_maps.h"

namespace pictura {
namespace {

TEST(Road, FindsTheLaneUnderTheAgent) {
  const MapRules map = make_map_rules(*testing::stadium(200, 2), {});
  const LaneFit fit = fit_lane(map.view(), {55, 0.5f}, 0, 0.1f, -1);
  EXPECT_EQ(fit.lane, 0);
  EXPECT_NEAR(fit.offset_m, 0.5f, 1e-5);
  EXPECT_NEAR(fit.angle_rad, 0.1f, 1e-6);
  EXPECT_EQ(fit.speed_limit_mps, 10);
  EXPECT_NEAR(fit_lane(map.view(), {55, 3.2f}, 0, 0, -1).offset_m, -0.8f, 1e-5);
  EXPECT_EQ(fit_lane(map.view(), {55, 3.2f}, 0, 0, -1).lane, 4);
  EXPECT_EQ(fit_lane(map.view(), {55, 16}, 0, 0, -1).lane, -1);
}

TEST(Road, KeepsItsLaneNearTheBorder) {
  const MapRules map = make_map_rules(*testing::stadium(200, 2), {});
  // At y = 2.1 m lane 4 is nearer by 0.2 m, which scores 0.035: less than the 0.05 for leaving a lane.
  EXPECT_EQ(fit_lane(map.view(), {55, 2.1f}, 0, 0, 0).lane, 0);
  EXPECT_EQ(fit_lane(map.view(), {55, 2.1f}, 0, 0, 4).lane, 4);
  EXPECT_EQ(fit_lane(map.view(), {55, 2.3f}, 0, 0, 0).lane, 4);
}

TEST(Road, PrefersTheLaneInDrivingDirection) {
  // On a stadium two opposite lanes, at y = 0 and y = 40, are far apart. On a ring, heading decides nothing.
  const MapRules map = make_map_rules(*testing::ring_road(30), {});
  const LaneFit fit = fit_lane(map.view(), {0, -31}, 0, 0, -1);
  EXPECT_NEAR(fit.offset_m, -1, 0.02);
  EXPECT_NEAR(fit.angle_rad, 0, 0.01);
}

TEST(Road, LevelsAreSeparate) {
  const MapRules map = make_map_rules(*testing::stadium(200, 1), {});
  EXPECT_EQ(fit_lane(map.view(), {55, 0}, 3, 0, -1).lane, -1);
  EXPECT_FALSE(is_on_road(map.view(), {55, 0}, 3));
  EXPECT_TRUE(is_on_road(map.view(), {55, 0}, 1));
}

TEST(Road, IdentifiesTheDrivableSurface) {
  const MapRules map = make_map_rules(*testing::stadium(200, 2), {});
  EXPECT_TRUE(is_on_road(map.view(), {55, -1.9f}, 0));
  EXPECT_TRUE(is_on_road(map.view(), {55, 5.9f}, 0));
  EXPECT_FALSE(is_on_road(map.view(), {55, -2.3f}, 0));
  EXPECT_FALSE(is_on_road(map.view(), {55, 20}, 0));
}

TEST(Road, PosesFollowTheArcLength) {
  const MapRules map = make_map_rules(*testing::ring_road(30), {});
  const LanePose pose = pose_on_lane(map.view(), 1, 30 * 0.5f);
  const float angle = kHalfPi + 0.5f;
  EXPECT_NEAR(pose.position_m.x, 30 * std::cos(angle), 0.1);
  EXPECT_NEAR(pose.position_m.y, 30 * std::sin(angle), 0.1);
  EXPECT_NEAR(pose.heading_rad, wrap_angle(angle + kHalfPi), 0.01);
}

TEST(Road, OffRoadWhenTheBoxTouchesAnEdge) {
  testing::Stage stage(testing::stadium(200, 1), 2);
  // Half of the width is 1 m, so the agent touches the edge at y = -2 from y = -1 on.
  stage.put(0, {50, -0.98f}, 0, 5);
  stage.put(1, {100, -1.02f}, 0, 5);
  stage.set(1, Conditioning::off_road, 1.5f);
  const std::vector<float> rewards = stage.step();
  EXPECT_EQ(stage.events(0), kEventNone);
  EXPECT_EQ(stage.events(1), kEventOffRoad);
  EXPECT_NEAR(rewards[1], -1.5, 0.01);
  EXPECT_EQ(stage.worlds.state.agents.halt_reason[1], kEventOffRoad);
}

TEST(Road, OffRoadWhenTheCenterLeavesTheSurface) {
  auto map = testing::stadium(200, 1);
  map->road_edges.clear();
  testing::Stage stage(map, 1);
  stage.put(0, {50, -1.9f}, -0.3f, 10);
  EXPECT_EQ((stage.step(), stage.events(0)), kEventOffRoad);
}

TEST(Road, WallContactsHaltAndAreCountedSeparately) {
  const auto map = testing::stadium(200, 1);
  testing::Stage stage(map, 2);
  const std::vector<WallFace> walls{{{60, -1, 0}, {60, 1, 0}, 3}, {{160, -1, 8}, {160, 1, 8}, 3}};
  const MapRules with_walls = make_map_rules(*map, walls);
  stage.worlds.setup.map_views[0] = with_walls.view();
  stage.set(0, Conditioning::off_road, 2);
  stage.put(0, {56.3f, 0}, 0, 10);   // bumper at 59.5
  stage.put(1, {156.3f, 0}, 0, 10);  // that wall is on a bridge
  EXPECT_NEAR(stage.step()[0], -2, 0.01);
  EXPECT_EQ(stage.events(0), kEventWall);
  EXPECT_EQ(stage.events(1), kEventNone);
}

}  // namespace
}  // namespace pictura
