// Pedestrians: the walkways that a map gives them, where they stand and go, and their events.
#include <cmath>
#include <ctime>
#include <set>

#include <gtest/gtest.h>

#include "pictura/backends/make_simulator.h"
#include "pictura/map/load_map.h"
#include "pictura/simulator/simulator.h"
#include "pictura/tests/simulator/stage.h"
#include "pictura/tests/simulator/test_maps.h"

namespace pictura {
namespace {

std::vector<Vec3> straight(Vec2 from, Vec2 to, int pieces) {
  std::vector<Vec3> points;
  for (int i = 0; i <= pieces; ++i) {
    const Vec2 at = from + (to - from) * (static_cast<float>(i) / static_cast<float>(pieces));
    points.push_back({at.x, at.y, 0});
  }
  return points;
}

/// A stadium of one lane (y = -2 .. 2 for x = 0 .. 200) with sidewalks on both sides of its southern straight: the
/// inner one at y = 5, in two lanes that meet at x = 100; the outer one at y = -5.
std::shared_ptr<RoadMap> street() {
  auto map = testing::stadium(200, 1);
  testing::add_side_lane(map.get(), LaneType::sidewalk, straight({0, 5}, {100, 5}, 10));
  testing::add_side_lane(map.get(), LaneType::sidewalk, straight({100.3f, 5}, {200, 5}, 10));
  testing::add_side_lane(map.get(), LaneType::sidewalk, straight({200, -5}, {0, -5}, 20));
  return map;
}

MapRules world_map(const RoadMap& map) { return make_map_rules(map, {}); }

float total_m(const Walkways& walkways) { return walkways.end_m.empty() ? 0 : walkways.end_m.back(); }

/// Returns the number of sets of pieces that are connected for walking.
int networks(const Walkways& walkways) {
  std::vector<int> mark(walkways.pieces.size(), -1);
  int count = 0;
  for (size_t first = 0; first < mark.size(); ++first) {
    if (mark[first] >= 0) continue;
    std::vector<size_t> open{first, first ^ 1};
    while (!open.empty()) {
      const size_t piece = open.back();
      open.pop_back();
      if (mark[piece] >= 0) continue;
      mark[piece] = count;
      const auto node = static_cast<size_t>(walkways.pieces[piece].to_node);
      for (int32_t i = walkways.leave_begin[node]; i < walkways.leave_begin[node + 1]; ++i) {
        const auto next = static_cast<size_t>(walkways.leaving[i]);
        open.push_back(next);
        open.push_back(next ^ 1);
      }
    }
    ++count;
  }
  return count;
}

TEST(Walkways, FollowSidewalksInBothDirectionsAndJoinWhereTheyMeet) {
  const Walkways walkways = world_map(*street()).walkways;
  EXPECT_NEAR(total_m(walkways), 2 * 400, 1);
  EXPECT_EQ(networks(walkways), 2);
  for (size_t i = 0; i < walkways.pieces.size(); ++i) {
    const WalkPiece &piece = walkways.pieces[i], &back = walkways.pieces[i ^ 1];
    EXPECT_NEAR(dot(piece.direction, back.direction), -1, 1e-5);
    EXPECT_FLOAT_EQ(std::fabs(piece.a_m.y), 5);
  }
}

TEST(Walkways, BuildTimeIsLinearInCrosswalks) {
  constexpr float kLength_m = 20'000;
  constexpr int kCrosswalks = 40'000;
  auto map = testing::stadium(kLength_m, 1);
  for (const float y : {5.0f, -5.0f}) {
    testing::add_side_lane(map.get(), LaneType::sidewalk, straight({0, y}, {kLength_m, y}, 2000));
  }
  for (int i = 0; i < kCrosswalks; ++i) {
    const float x = (static_cast<float>(i) + 0.5f) * (kLength_m / kCrosswalks);
    testing::add_crosswalk(map.get(), {{x - 0.1f, -4, 0}, {x + 0.1f, -4, 0}, {x + 0.1f, 4, 0}, {x - 0.1f, 4, 0}});
  }
  const std::clock_t begin = std::clock();  // processor time of the process, independent of other load
  const Walkways walkways = world_map(*map).walkways;
  EXPECT_LT(std::clock() - begin, 4 * CLOCKS_PER_SEC);
  EXPECT_EQ(networks(walkways), 1);
}

TEST(Walkways, CrosswalksLeadOverTheRoad) {
  auto map = street();
  testing::add_crosswalk(map.get(), {{48.5f, -3, 0}, {51.5f, -3, 0}, {51.5f, 3, 0}, {48.5f, 3, 0}});
  const Walkways walkways = world_map(*map).walkways;
  EXPECT_EQ(networks(walkways), 1);
  EXPECT_NEAR(total_m(walkways), 2 * 410, 1);
  const auto crosses = [](const WalkPiece& piece) {
    return std::fabs(piece.a_m.x - 50) < 0.1f && std::fabs(piece.direction.x) < 0.1f && piece.length_m > 5.9f;
  };
  EXPECT_EQ(std::count_if(walkways.pieces.begin(), walkways.pieces.end(), crosses), 2);
}

TEST(Walkways, LeaveOutSidewalksOnTheRoadAndDeadStubs) {
  auto map = street();
  // Sidewalks over the road and onto a stub of 30 m: neither is a walkway.
  testing::add_side_lane(map.get(), LaneType::sidewalk, straight({20, -1}, {20, 1}, 1));
  testing::add_side_lane(map.get(), LaneType::sidewalk, straight({20, 10}, {20, 40}, 3));
  EXPECT_NEAR(total_m(world_map(*map).walkways), 2 * 400, 1);
}

TEST(Walkways, UseShouldersWithoutASidewalk) {
  auto map = testing::stadium(200, 1);
  testing::add_side_lane(map.get(), LaneType::shoulder, straight({0, -3}, {200, -3}, 20));
  testing::add_side_lane(map.get(), LaneType::median, straight({0, 4}, {200, 4}, 20));
  EXPECT_NEAR(total_m(world_map(*map).walkways), 2 * 200, 1);
  testing::add_side_lane(map.get(), LaneType::sidewalk, straight({0, -5}, {100, -5}, 10));
  EXPECT_NEAR(total_m(world_map(*map).walkways), 2 * 100, 1);
}

TEST(Walkways, WalksHaveTheirLengthAndTurnBackAtDeadEnds) {
  const MapRules map = world_map(*street());
  const MapView view = map.view();
  for (uint32_t i = 0; i < 200; ++i) {
    RandomStream random({.seed = 1, .agent = i, .purpose = Purpose::goals});
    const RoutePoint from{static_cast<int32_t>(i % view.walk_pieces.size()), 0.5f};
    // The distance is shorter than the way to the far end and back. So the way from A to B is the distance, or is
    // mirrored at one end.
    const float distance_m = random.uniform(20, 60);
    const RoutePoint to = advance_along_walkway(view, from, distance_m, &random);
    const LanePose a = pose_on_walk(view, from.lane, from.s_m), b = pose_on_walk(view, to.lane, to.s_m);
    EXPECT_EQ(a.position_m.y, b.position_m.y);
    const float ahead = a.position_m.x + distance_m * std::cos(a.heading_rad);
    const float mirrored = ahead > 200 ? 400 - ahead : ahead < 0 ? -ahead : ahead;
    EXPECT_NEAR(b.position_m.x, mirrored, 0.5) << i;
  }
}

SimulatorConfig pedestrians_only() {
  SimulatorConfig config = testing::cars();
  config.pedestrian_fraction = 1;
  return config;
}

TEST(Pedestrians, UseWalkwaysAndHaveOnlyGoalAndCollisionEvents) {
  auto map = street();
  testing::add_crosswalk(map.get(), {{48.5f, -3, 0}, {51.5f, -3, 0}, {51.5f, 3, 0}, {48.5f, 3, 0}});
  testing::Stage stage(map, 40, pedestrians_only());
  const WorldView world = stage.world();
  int on_crosswalk = 0;
  for (int agent = 0; agent < 40; ++agent) {
    draw_agent(world, agent);
    place_agent(world, agent, 0);
    const auto i = static_cast<size_t>(agent);
    EXPECT_EQ(stage.worlds.state.agents.agent_class[i], AgentClass::pedestrian);
    const auto on_walk = [&](float x, float y) {
      return std::fabs(std::fabs(y) - 5) < 1e-3f || std::fabs(x - 50) < 1e-3f;
    };
    EXPECT_TRUE(on_walk(stage.worlds.state.agents.x_m[i], stage.worlds.state.agents.y_m[i]));
    on_crosswalk += std::fabs(stage.worlds.state.agents.y_m[i]) < 4.9f;
    for (size_t k = 0; k < kNumWaypoints; ++k) {
      EXPECT_TRUE(on_walk(stage.worlds.state.agents.waypoint_x_m[i * kNumWaypoints + k],
                          stage.worlds.state.agents.waypoint_y_m[i * kNumWaypoints + k]));
    }
    const float* conditioning = &stage.worlds.state.agents.conditioning[i * kNumConditioning];
    for (int c = 0; c < kNumRewardConditioning; ++c) {
      const auto which = static_cast<Conditioning>(c);
      const bool counts =
          which == Conditioning::delta_goal_m || which == Conditioning::v_goal_mps || which == Conditioning::collision;
      if (!counts) {
        EXPECT_EQ(conditioning[c], 0) << kConditioningNames[c];
      }
    }
    EXPECT_LE(conditioning[static_cast<int>(Conditioning::delta_goal_m)], 0.5f);
  }
  EXPECT_LT(on_crosswalk, 10);
}

TEST(Pedestrians, MayStandOnTheRoadAndPassRedLights) {
  auto map = street();
  testing::add_light(map.get(), 100, 4, 2, {0});
  testing::Stage stage(map, 1);
  stage.worlds.state.agents.agent_class[0] = AgentClass::pedestrian;
  stage.worlds.state.agents.length_m[0] = stage.worlds.state.agents.width_m[0] = 0.5f;
  stage.worlds.state.lights[0] = LightState::red;
  // Along the road over the line, then off the road: a car would halt at either.
  stage.put(0, {99.9f, 0}, 0, 2);
  stage.step();
  EXPECT_EQ(stage.events(0), kEventNone);
  stage.put(0, {80, 2.05f}, kHalfPi, 2);
  stage.step();
  EXPECT_EQ(stage.events(0), kEventNone);
  stage.worlds.state.agents.agent_class[0] = AgentClass::vehicle;
  stage.put(0, {80, 2.05f}, kHalfPi, 2);
  stage.step();
  EXPECT_EQ(stage.events(0), kEventOffRoad);
}

TEST(Pedestrians, AreAtTheHeightOfTheirWalkway) {
  auto map = testing::stadium(200, 1);
  std::vector<Vec3> kerb = straight({0, -6}, {200, -6}, 20);
  for (Vec3& point : kerb) point.z = 0.2f + 0.005f * point.x;
  testing::add_side_lane(map.get(), LaneType::sidewalk, kerb);
  const MapRules world = world_map(*map);
  EXPECT_NEAR(fit_walk(world.view(), {100, -6}, 0.6f, 0, -1).z_m, 0.7, 1e-4);
  EXPECT_EQ(fit_walk(world.view(), {100, -1}, 0.6f, 0, -1).z_m, 0) << "nearer to the road";
  EXPECT_EQ(fit_lane(world.view(), {100, -1}, 0.6f, 0, -1).z_m, 0);
  EXPECT_EQ(fit_walk(world.view(), {100, -30}, 0.6f, 0, -1).z_m, 0.6f) << "near neither";
}

TEST(Pedestrians, SpawnAtTheHeightOfTheirWalkwayWithTheirBoxes) {
  auto map = testing::stadium(200, 1);
  std::vector<Vec3> kerb = straight({0, -4}, {200, -4}, 20);  // within reach of the lane, at height 0
  for (Vec3& point : kerb) point.z = 0.5f;
  testing::add_side_lane(map.get(), LaneType::sidewalk, kerb);
  const auto simulator = make_simulator("cpu", pedestrians_only(), {map}, {{0, 30, 0}});
  const AgentStateView state = simulator->state();
  int present = 0;
  for (size_t i = 0; i < 30; ++i) {
    if (state.status[i] != AgentStatus::active) continue;
    ++present;
    EXPECT_NEAR(state.z_m[i], 0.5f, 1e-4f);
    EXPECT_EQ(simulator->scene().agents[i].center_m.z, state.z_m[i]);
    EXPECT_EQ(state.lane[i], 0) << "the nearest lane, not the one with the number of its piece of walkway";
  }
  EXPECT_GT(present, 20);
}

TEST(Pedestrians, DoNotAimAtPlacesUnderParkedCars) {
  auto map = street();
  for (int i = 0; i < 20; ++i) {
    const float x_m = 5 + 10 * static_cast<float>(i);
    map->parking_spaces.push_back({{x_m, i % 2 ? 5.0f : -5.0f, 0}, 0, 5, 2});
  }
  SimulatorConfig config = pedestrians_only();
  config.parked_cars = 30;
  const auto simulator = make_simulator("cpu", config, {map}, {{0, 100, 0}});
  ASSERT_GT(simulator->spawn_report().parked_placed, 10);
  const AgentStateView state = simulator->state();
  for (int i = 0; i < 100 * kNumWaypoints; ++i) {
    if (state.status[i / kNumWaypoints] != AgentStatus::active) continue;
    for (size_t car = 100; car < 130; ++car) {
      const AgentBox& box = simulator->scene().agents[car];
      if (!box.drawn) continue;
      const OrientedBox print = footprint(box);
      const Vec2 apart = Vec2{state.waypoint_x_m[i], state.waypoint_y_m[i]} - print.center_m;
      const float outside_m = std::max(std::fabs(dot(apart, print.forward)) - print.half_length_m,
                                       std::fabs(cross(print.forward, apart)) - print.half_width_m);
      EXPECT_GT(outside_m, 0.5f) << "waypoint " << i << " of car " << car;
    }
  }
}

TEST(Pedestrians, AreRefusedWithoutWalkways) {
  SimulatorConfig config = testing::cars();
  config.pedestrian_fraction = 0.5f;
  const auto simulator = make_simulator("cpu", config, {testing::ring_road(100)}, {{0, 40, 0}});
  const SpawnReport report = simulator->spawn_report();
  const AgentStateView state = simulator->state();
  int walkers = 0;
  for (int i = 0; i < 40; ++i) {
    const bool walks = state.agent_class[i] == AgentClass::pedestrian;
    walkers += walks;
    if (walks) {
      EXPECT_EQ(state.status[i], AgentStatus::absent);
    }
  }
  EXPECT_GT(walkers, 8);
  EXPECT_EQ(report.refused_no_place, walkers);
  EXPECT_EQ(report.refused_taken + report.refused_no_place, report.refused);
  EXPECT_EQ(report.asked, report.spawned + report.refused);
}

TEST(Pedestrians, WalkInEveryTown) {
  const std::vector<std::string> towns = known_towns();
  if (towns.empty()) GTEST_SKIP() << "no towns: set PICTURA_DATA";
  for (const std::string& town : towns) {
    SCOPED_TRACE(town);
    const auto map = load_map(town);
    const auto simulator = make_simulator("cpu", {}, {map}, {{0, 120, 0}});
    EXPECT_EQ(simulator->spawn_report().spawned, 120);
    const Walkways walkways = world_map(*map).walkways;
    EXPECT_GT(total_m(walkways), 2000);
  }
}

}  // namespace
}  // namespace pictura
