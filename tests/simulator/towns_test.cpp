// Properties of every town: all agents are accounted for, parked cars leave the lanes free, and goals can be reached.
#include <cmath>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "pictura/backends/make_simulator.h"
#include "pictura/map/lane_graph.h"
#include "pictura/map/load_map.h"
#include "pictura/simulator/controllers/goal_places.h"
#include "pictura/simulator/host_worlds.h"
#include "pictura/simulator/rules/observe.h"
#include "pictura/simulator/rules/spawn.h"
#include "pictura/simulator/simulator.h"
#include "pictura/tests/simulator/test_maps.h"

namespace pictura {
namespace {

SimulatorConfig whole_world() {
  SimulatorConfig config;
  config.vector_observations = false;
  return config;
}

/// Returns a world at the start of its first episode, as the rules see it.
std::unique_ptr<HostWorlds> first_step(const SimulatorConfig& config, std::shared_ptr<const RoadMap> map, int agents) {
  const auto simulator = make_simulator("cpu", config, {std::move(map)}, {{0, agents, 0}});
  auto worlds = std::make_unique<HostWorlds>(SimulatorSetup(config, simulator->maps(), {}, simulator->worlds()));
  worlds->state.restore(worlds->setup, simulator->save());
  return worlds;
}

/// Returns the eight CARLA towns where they are installed, and procedural towns everywhere.
std::vector<std::string> all_towns() {
  std::vector<std::string> towns = known_towns();
  for (const char* town : {"procedural:1", "procedural:2", "city:1", "city:2"}) towns.emplace_back(town);
  return towns;
}

TEST(Towns, AccountForEveryRequestedAgent) {
  for (const std::string& town : all_towns()) {
    SCOPED_TRACE(town);
    const auto simulator = make_simulator("cpu", whole_world(), {load_map(town)}, {{0, 1024, 0}});
    const SpawnReport report = simulator->spawn_report();
    const AgentStateView state = simulator->state();
    int64_t counts[3] = {};
    for (int i = 0; i < 1024; ++i) {
      ASSERT_LE(state.refusal[i], SpawnFailure::taken);
      EXPECT_EQ(state.refusal[i] != SpawnFailure::none, state.status[i] == AgentStatus::absent);
      ++counts[static_cast<int>(state.refusal[i])];
    }
    EXPECT_EQ(report.asked, 1024);
    const StepResult result = simulator->step(std::vector<int32_t>(1024, 0));
    EXPECT_TRUE(std::equal(result.refusal.begin(), result.refusal.end(), state.refusal)) << "a step says why";
    EXPECT_EQ(report.spawned, counts[0]);
    EXPECT_EQ(report.refused_no_place, counts[1]);
    EXPECT_EQ(report.refused_taken, counts[2]);
    EXPECT_EQ(report.spawned + report.refused, report.asked);
    EXPECT_GT(report.spawned, 100);
  }
}

/// Returns points all over a box.
std::vector<Vec2> points_of(const AgentBox& box) {
  const OrientedBox print = footprint(box);
  std::vector<Vec2> points;
  for (int i = -8; i <= 8; ++i) {
    for (int j = -4; j <= 4; ++j) {
      points.push_back(print.center_m + print.forward * (print.half_length_m * static_cast<float>(i) / 8) +
                       left_normal(print.forward) * (print.half_width_m * static_cast<float>(j) / 4));
    }
  }
  return points;
}

TEST(Towns, ParkedCarsLeaveTheLanesFree) {
  for (const std::string& town : all_towns()) {
    SCOPED_TRACE(town);
    const auto worlds = first_step(whole_world(), load_map(town), 1);
    const WorldView view = worlds->world(0);
    int placed = 0;
    for (int car = 0; car < 32; ++car) {
      for (int i = 0; i < kSpawnTries && !view.map.parking_spots.empty(); ++i) {
        const ParkingSpot& spot = parking_spot(view, car, i);
        const AgentBox box = parked_box(view, car, spot);
        if (!may_park(view.map, box, spot)) continue;
        ++placed;
        for (const Vec2 p : points_of(box)) {
          for (const int32_t item : items_at(view.map.segment_cells, p)) {
            const LaneSegment& segment = view.map.segments[item];
            const Vec2 from_a = p - segment.a_m.xy();
            const float along = dot(from_a, segment.direction);
            if (!segment.is_driven || along < 0 || along > segment.length_m ||
                std::fabs(segment.a_m.z - box.center_m.z) > 1) {
              continue;
            }
            ASSERT_GT(std::fabs(cross(segment.direction, from_a)), segment.half_width_m - 0.11f) << p.x << ' ' << p.y;
          }
        }
      }
    }
    EXPECT_GT(placed, 32) << "places for 32 cars";
  }
}

TEST(Towns, EveryGoalCanBeReached) {
  for (const std::string& town : all_towns()) {
    SCOPED_TRACE(town);
    const auto map = load_map(town);
    const auto worlds = first_step(whole_world(), map, 150);
    const WorldView world = worlds->world(0);
    // The redrawn waypoints are the agents' waypoints.
    for (int agent = 0; agent < 150; ++agent) {
      if (!is_active(world, agent)) continue;
      const auto places = goal_places(world, agent, 0, start_place(world, agent));
      for (int i = 0; i < kNumWaypoints; ++i) {
        const Vec3 given = waypoint_of(world.agents, agent, i);
        const Vec3 drawn = pose_of(world, agent, places[i]).position_m;
        ASSERT_TRUE(given.x == drawn.x && given.y == drawn.y && given.z == drawn.z);
      }
    }
    const auto [on_roads, on_walkways] = follow_goals(world, LaneGraph(*map), 4);
    EXPECT_GT(on_roads.waypoints, 1000);
    EXPECT_GT(on_walkways.waypoints, 40);
    EXPECT_EQ(on_roads.unreachable, 0) << "of " << on_roads.waypoints;
    EXPECT_EQ(on_walkways.unreachable, 0) << "of " << on_walkways.waypoints;
  }
}

/// Checks that the count above detects unreachable goals.
TEST(Towns, GoalsBeyondAWallCannotBeReached) {
  const auto map = testing::stadium(200, 1);
  for (const float y_m : {-5.0f, -8.0f}) {
    testing::add_side_lane(map.get(), LaneType::sidewalk, {{0, y_m, 0}, {100, y_m, 0}, {200, y_m, 0}});
  }
  SimulatorConfig config = testing::cars();
  config.pedestrian_fraction = 1;
  const auto unreachable = [&] {
    const auto worlds = first_step(config, map, 20);
    const auto [on_roads, on_walkways] = follow_goals(worlds->world(0), LaneGraph(*map), 4);
    EXPECT_EQ(on_roads.waypoints, 0);
    EXPECT_GT(on_walkways.waypoints, 100);
    return on_walkways.unreachable;
  };
  EXPECT_EQ(unreachable(), 0);
  // A wall across one of the two sidewalks; the first piece of a building line always stands.
  map->building_lines = {{{100, -9, 0}, {100, -7, 0}}};
  EXPECT_GT(unreachable(), 0);
}

}  // namespace
}  // namespace pictura
