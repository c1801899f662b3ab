// What must hold in every town: everybody is accounted for, parked cars leave the lanes free, and goals can be reached.
#include <cmath>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "pictura/map/lane_graph.h"
#include "pictura/map/load_map.h"
#include "pictura/simulator/rules/observe.h"
#include "pictura/simulator/rules/spawn.h"
#include "pictura/simulator/simulator.h"
#include "pictura/simulator/world_batch.h"

namespace pictura {
namespace {

SimulatorConfig whole_world() {
  SimulatorConfig config;
  config.vector_observations = false;
  return config;
}

/// The eight CARLA towns where they are, and procedural ones everywhere.
std::vector<std::string> all_towns() {
  std::vector<std::string> towns = known_towns();
  for (const char* town : {"procedural:1", "procedural:2"}) towns.emplace_back(town);
  return towns;
}

TEST(Towns, AccountForEveryAgentThatIsAskedFor) {
  for (const std::string& town : all_towns()) {
    SCOPED_TRACE(town);
    const auto simulator = make_simulator("cpu", whole_world(), {load_map(town)}, {{0, 1024, 0}});
    const SpawnReport report = simulator->spawn_report();
    const AgentStateView state = simulator->state();
    int64_t counts[3] = {};
    for (int i = 0; i < 1024; ++i) {
      ASSERT_LE(state.refusal[i], 2);
      EXPECT_EQ(state.refusal[i] != 0, state.status[i] == static_cast<uint8_t>(AgentStatus::absent));
      ++counts[state.refusal[i]];
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

/// Points all over a box.
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
    WorldBatch batch(whole_world(), {load_map(town)}, {{0, 1, 0}});
    const WorldView view = batch.world(0);
    int placed = 0;
    for (int car = 0; car < 32; ++car) {
      for (int i = 0; i < kSpawnTries && !view.map.parking_spots.empty(); ++i) {
        const ParkingSpot& spot = parking_spot(view, car, i);
        const AgentBox box = parked_box(view, car, spot);
        if (!may_park(view.map, box, spot)) continue;
        ++placed;
        for (const Vec2 p : points_of(box)) {
          for (const int32_t item : items_at(view.map.segment_cells, p)) {
            const LaneSegment& segment = view.map.segments[static_cast<size_t>(item)];
            const Vec2 from_a = p - segment.a_m.xy();
            const float along = dot(from_a, segment.direction);
            if (!view.map.lanes[static_cast<size_t>(segment.lane)].is_driven || along < 0 || along > segment.length_m ||
                std::fabs(segment.a_m.z - box.center_m.z) > 1) {
              continue;
            }
            ASSERT_GT(std::fabs(cross(segment.direction, from_a)), segment.half_width_m - 0.11f) << p.x << ' ' << p.y;
          }
        }
      }
    }
    EXPECT_GT(placed, 32) << "room for 32 cars";
  }
}

TEST(Towns, EveryGoalCanBeReached) {
  for (const std::string& town : all_towns()) {
    SCOPED_TRACE(town);
    SimulatorConfig config = whole_world();
    const auto map = load_map(town);
    const auto simulator = make_simulator("cpu", config, {map}, {{0, 150, 0}});
    WorldBatch batch(config, {map}, {{0, 150, 0}});
    batch.restore(simulator->save());
    const WorldView world = batch.world(0);
    const LaneGraph graph(*map);
    int unreachable = 0, chains = 0;
    for (int agent = 0; agent < 150; ++agent) {
      if (!is_active(world, agent) || walks(world, agent)) continue;
      // From the first place on, chain after chain, waypoint after waypoint.
      RoutePoint at = spawn_point(world, agent, 0);
      for (uint32_t chain = 0; chain < 4; ++chain, ++chains) {
        RandomStream random = agent_stream(world, agent, chain, Purpose::goals);
        for (int k = 0; k < kNumWaypoints; ++k) {
          const RoutePoint next = next_waypoint(world.map, at, &random);
          const auto place = [&](RoutePoint p) {
            return LanePlace{p.lane, std::min(p.s_m, map->lanes[static_cast<size_t>(p.lane)].length_m)};
          };
          const auto route = graph.route(place(at), place(next));
          // The gap itself, but for what neighbours differ in length, and a lane of the network's end.
          unreachable += !route || route->length_m > 2 * kMaxWaypointGap_m;
          EXPECT_TRUE(map->lanes[static_cast<size_t>(next.lane)].is_endless);
          at = next;
        }
      }
    }
    EXPECT_GT(chains, 300);
    EXPECT_EQ(unreachable, 0) << "of " << chains * kNumWaypoints;
  }
}

}  // namespace
}  // namespace pictura
