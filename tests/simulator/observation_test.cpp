// Every number of the observation, compared with values computed by hand on a straight road.
#include <cmath>

#include <gtest/gtest.h>

#include "pictura/map/load_map.h"
#include "pictura/map/map_geometry.h"
#include "pictura/simulator/compiled_map.h"
#include "pictura/simulator/rules/observe.h"
#include "pictura/tests/simulator/stage.h"
#include "pictura/tests/simulator/test_maps.h"

namespace pictura {
namespace {

struct Observation : ::testing::Test {
  Observation() : stage(make_map(), 20, testing::cars({.wall_observations = true})) {
    // The ego heads east at (100, 0.5); 18 other agents stand ahead of it on the left lane; agent 19 is far away.
    stage.put(0, {100, 0.5f}, 0.1f, 6);
    for (int i = 1; i <= 18; ++i) stage.put(i, {105.0f + 5 * static_cast<float>(i), 4}, kPi, 2);
    stage.put(19, {0, 40}, kPi, 2);
  }
  static std::shared_ptr<const RoadMap> make_map() {
    auto map = testing::stadium(200, 2);
    testing::add_light(map.get(), 120, 8, 2, {0, 4});
    // Buildings south of the road, in pieces of 12 m; the first piece always stands.
    for (float x = 120; x > -20; x -= 12) map->building_lines.push_back({{x, -9, 0.5f}, {x - 12, -9, 0.5f}});
    return map;
  }
  void write_observation() { observe(stage.world(), 0, 1, true, stage.results.observation_view()); }
  /// Returns a point in the ego frame.
  static Vec2 local(float x, float y) {
    const float c = std::cos(0.1f), s = std::sin(0.1f);
    return {(x - 100) * c + (y - 0.5f) * s, -(x - 100) * s + (y - 0.5f) * c};
  }

  testing::Stage stage;
};

TEST_F(Observation, Ego) {
  AgentState& agents = stage.worlds.state.agents;
  agents.steer_rad[0] = 0.22f;
  agents.accel_long_mps2[0] = -2;
  agents.accel_lat_mps2[0] = 1;
  write_observation();
  const float* ego = stage.results.observation_view().ego.data();
  const float expected[kEgoFeatures] = {6 / 20.0f, 4 / 6.0f,   2 / 3.0f,    0.4f,          -0.4f,
                                        1 / 4.0f,  10 / 20.0f, 0.5f / 4.0f, std::cos(0.1f)};
  for (int i = 0; i < kEgoFeatures; ++i) EXPECT_NEAR(ego[i], expected[i], 1e-5) << i;
}

TEST_F(Observation, PartnersAreTheNearestInOrder) {
  write_observation();
  const ObservationView out = stage.results.observation_view();
  ASSERT_EQ(out.set_counts[0], kMaxPartners);
  for (int i = 0; i < kMaxPartners; ++i) {
    const float* row = out.partners.data() + i * kPartnerFeatures;
    // Heading west: the box's centre lies 1.2 m west of its rear axle.
    const Vec2 at = local(105.0f + 5 * static_cast<float>(i + 1) - 1.2f, 4);
    EXPECT_NEAR(row[0], at.x / 120, 1e-5) << i;
    EXPECT_NEAR(row[1], at.y / 120, 1e-5) << i;
    EXPECT_EQ(row[2], 0);
    EXPECT_NEAR(row[3], 4 / 6.0, 1e-6);
    EXPECT_NEAR(row[4], 2 / 3.0, 1e-6);
    EXPECT_NEAR(row[5], std::cos(kPi - 0.1), 1e-6);
    EXPECT_NEAR(row[6], std::sin(kPi - 0.1), 1e-6);
    EXPECT_NEAR(row[7], 2 / 20.0, 1e-6);
  }
}

TEST(ObservationOfParkedCars, EqualsThatOfPartnersAtRest) {
  SimulatorConfig config = testing::cars();
  config.parked_cars = 1;
  testing::Stage parking(testing::stadium(200, 2), 2, config);
  AgentBox& car = parking.worlds.state.boxes[2];
  car.center_m = {95, -3.5f, 0.5f};
  car.cos_heading = 0;
  car.sin_heading = 1;
  car.length_m = 5;
  car.width_m = 1.8f;
  car.height_m = 1.5f;
  car.palette = 2;
  car.drawn = 1;
  parking.put(1, {130, 4}, kPi, 2);
  parking.put(0, {100, 0.5f}, 0.1f, 6);
  observe(parking.world(), 0, 1, true, parking.results.observation_view());
  const ObservationView out = parking.results.observation_view();
  ASSERT_EQ(out.set_counts[0], 2);
  const float c = std::cos(0.1f), s = std::sin(0.1f);
  const float expected[kPartnerFeatures] = {(-5 * c - 4 * s) / 120,   (5 * s - 4 * c) / 120,    0.05f, 5 / 6.0f, 0.6f,
                                            std::cos(kHalfPi - 0.1f), std::sin(kHalfPi - 0.1f), 0};
  for (size_t i = 0; i < kPartnerFeatures; ++i) EXPECT_NEAR(out.partners[i], expected[i], 1e-5) << i;
}

TEST_F(Observation, AuxiliarySlotsCanBeZero) {
  stage.worlds.setup.options.auxiliary_observations = false;
  write_observation();
  const ObservationView out = stage.results.observation_view();
  EXPECT_EQ(out.ego[7], 0);
  EXPECT_EQ(out.ego[8], 0);
  EXPECT_NE(out.ego[0], 0);
  for (size_t i = 0; i < kMaxPartners; ++i) EXPECT_EQ(out.partners[i * kPartnerFeatures + 7], 0);
}

TEST_F(Observation, ControlsAreStopLinesWithStateAndWhetherTheyHoldTheEgo) {
  stage.worlds.state.lights[0] = LightState::red;
  write_observation();
  const ObservationView out = stage.results.observation_view();
  ASSERT_EQ(out.set_counts[3], 1);
  const Vec2 left = local(120, 6), right = local(120, -2);
  const float expected[kControlFeatures] = {left.x / 120, left.y / 120, right.x / 120, right.y / 120, 0, 1, 1};
  for (size_t i = 0; i < kControlFeatures; ++i) EXPECT_NEAR(out.controls[i], expected[i], 1e-5) << i;
  stage.worlds.state.lights[0] = LightState::green;
  write_observation();
  EXPECT_EQ(out.controls[5], -1);
  stage.worlds.state.lights[0] = LightState::yellow;
  write_observation();
  EXPECT_EQ(out.controls[5], 0.5f);
  for (const LightState state : {LightState::off, LightState::unknown}) {
    stage.worlds.state.lights[0] = state;
    write_observation();
    EXPECT_EQ(out.controls[5], 0);
  }
  for (size_t i = kControlFeatures; i < kMaxControls * kControlFeatures; ++i) EXPECT_EQ(out.controls[i], 0);
}

/// The arithmetic contract: a product is rounded before it is added, on every device.
float rounded_dot(Vec2 a, Vec2 b) {
  const volatile float x = a.x * b.x, y = a.y * b.y;
  return x + y;
}

TEST_F(Observation, ProductsAreRoundedBeforeTheyAreAdded) {
  const StopLine& line = stage.worlds.setup.maps[0]->rules.stop_lines[0];
  const AgentState& agents = stage.worlds.state.agents;
  for (int i = 0; i < 100; ++i) {
    const auto k = static_cast<float>(i);
    stage.put(0, {100 + 0.1f * k, 0.01f * k}, 0.03f * k, 8);
    write_observation();
    const Vec2 forward{agents.cos_heading[0], agents.sin_heading[0]}, left_of{-forward.y, forward.x};
    const ObservationView out = stage.results.observation_view();
    const Vec2 at{agents.x_m[0], agents.y_m[0]};
    const Vec2 ends[2] = {line.left_m.xy() - at, line.right_m.xy() - at};
    for (size_t end = 0; end < 2; ++end) {
      EXPECT_EQ(out.controls[2 * end], rounded_dot(ends[end], forward) * (1 / 120.0f)) << i;
      EXPECT_EQ(out.controls[2 * end + 1], rounded_dot(ends[end], left_of) * (1 / 120.0f)) << i;
    }
  }
}

TEST_F(Observation, WaypointsStartWithTheActiveOne) {
  AgentState& agents = stage.worlds.state.agents;
  for (size_t i = 0; i < 3; ++i) {
    agents.waypoint_x_m[i] = 110 + 30 * static_cast<float>(i);
    agents.waypoint_y_m[i] = 4 * static_cast<float>(i);
    agents.waypoint_z_m[i] = 1;
  }
  agents.next_waypoint[0] = 1;
  write_observation();
  const ObservationView out = stage.results.observation_view();
  for (int i = 0; i < 3; ++i) {
    const int index = std::min(1 + i, 2);
    const Vec2 at = local(110 + 30 * static_cast<float>(index), 4 * static_cast<float>(index));
    EXPECT_NEAR(out.waypoints[3 * i], at.x / 120, 1e-5);
    EXPECT_NEAR(out.waypoints[3 * i + 1], at.y / 120, 1e-5);
    EXPECT_NEAR(out.waypoints[3 * i + 2], 0.1, 1e-6);
  }
}

TEST_F(Observation, ConditioningIsScaledByThePapersRanges) {
  stage.set(0, Conditioning::delta_goal_m, 7);
  stage.set(0, Conditioning::v_goal_mps, 20);
  stage.set(0, Conditioning::center_bias_m, 0.25f);
  stage.set(0, Conditioning::throttle, 1.25f);
  write_observation();
  const ObservationView out = stage.results.observation_view();
  EXPECT_NEAR(out.conditioning[static_cast<size_t>(Conditioning::delta_goal_m)], 0, 1e-6);
  EXPECT_NEAR(out.conditioning[static_cast<size_t>(Conditioning::v_goal_mps)], 1, 1e-6);
  EXPECT_NEAR(out.conditioning[static_cast<size_t>(Conditioning::collision)], -1, 1e-6);
  EXPECT_NEAR(out.conditioning[static_cast<size_t>(Conditioning::center_bias_m)], 0.5, 1e-6);
  EXPECT_EQ(out.conditioning[static_cast<size_t>(Conditioning::velocity)], 0);
  EXPECT_NEAR(out.conditioning[static_cast<size_t>(Conditioning::throttle)], 1, 1e-6);
}

TEST_F(Observation, EveryCoefficientHasThePapersRange) {
  // The paper's table, in the order of conditioning.h; fixed coefficients read 0.
  const float lows[kNumConditioning] = {2,     0, 0,       0, 0, 0,    2.5e-4f, 0,       2.5e-4f,
                                        -0.5f, 0, 2.5e-4f, 0, 0, 0.8f, 0.8f,    2 / 3.0f};
  const float highs[kNumConditioning] = {12,   20, 3,       3, 1, 0.1f,  2.5e-2f, 1,   7.5e-3f,
                                         0.5f, 0,  7.5e-3f, 1, 0, 1.25f, 1.25f,   1.5f};
  for (const float share : {0.0f, 0.25f, 1.0f}) {
    for (int i = 0; i < kNumConditioning; ++i) {
      stage.set(0, static_cast<Conditioning>(i), lows[i] + share * (highs[i] - lows[i]));
    }
    write_observation();
    const ObservationView out = stage.results.observation_view();
    for (size_t i = 0; i < kNumConditioning; ++i) {
      const bool is_fixed = lows[i] == highs[i];
      EXPECT_NEAR(out.conditioning[i], is_fixed ? 0 : 2 * share - 1, 1e-5) << kConditioningNames[i];
    }
  }
  // A pedestrian's goal radius is below the range, and must differ from a vehicle's radius of 2 m.
  stage.set(0, Conditioning::delta_goal_m, 0.5f);
  write_observation();
  EXPECT_NEAR(stage.results.observation_view().conditioning[0], -1.3, 1e-6);
  stage.set(0, Conditioning::delta_goal_m, -50);
  write_observation();
  EXPECT_EQ(stage.results.observation_view().conditioning[0], -2);
}

/// Expects that listed pieces are exactly the pieces in sight: compared with all pieces of the map, from many places
/// and headings.
TEST_F(Observation, ListsHoldAllLanesBoundariesAndWallsInSight) {
  RandomStream random({.seed = 5, .purpose = Purpose::town});
  const MapRules& map = stage.worlds.setup.maps[0]->rules;
  for (int i = 0; i < 300; ++i) {
    const float heading = random.uniform(-kPi, kPi);
    const Vec2 at{random.uniform(0, 200), random.uniform(-1, 5)};
    stage.put(0, at, heading, 0);
    write_observation();
    const ObservationView out = stage.results.observation_view();
    for (const EntitySet set : {EntitySet::lanes, EntitySet::boundaries, EntitySet::walls}) {
      const bool lanes = set == EntitySet::lanes, walls = set == EntitySet::walls;
      const std::vector<ObservedPiece>& pieces = lanes   ? map.lane_pieces
                                                 : walls ? map.wall_pieces
                                                         : map.boundary_pieces;
      const Span<const float> rows = lanes ? out.lanes : walls ? out.walls : out.boundaries;
      int in_sight = 0, found = 0;
      for (const ObservedPiece& piece : pieces) {
        const Vec2 d = piece.middle_m.xy() - at;
        const Vec2 forward{cos_of(heading), sin_of(heading)};
        const float x = dot(d, forward), y = cross(forward, d);
        if (x > 120 || x < -20 || std::abs(y) > 30) continue;
        ++in_sight;
        for (size_t row = 0; row < 80; ++row) {
          const float* r = rows.data() + row * kLaneFeatures;
          if (std::abs(r[0] * 120 - x) < 1e-3 && std::abs(r[1] * 120 - y) < 1e-3 &&
              std::abs(r[3] * 5 - piece.half_length_m) < 1e-4 &&
              std::abs(r[4] - dot(piece.direction, forward)) < 1e-4 &&
              std::abs(r[5] - cross(forward, piece.direction)) < 1e-4) {
            ++found;
            break;
          }
        }
      }
      ASSERT_LT(in_sight, 80);
      EXPECT_EQ(out.set_counts[static_cast<int>(set)], in_sight) << i;
      EXPECT_EQ(found, in_sight) << i;
      for (size_t k = static_cast<size_t>(in_sight) * kLaneFeatures; k < 80 * kLaneFeatures; ++k) ASSERT_EQ(rows[k], 0);
    }
  }
}

/// Only places at the cell's edges and headings at the sector's ends see the far corners of the range.
TEST(ObservedLists, HoldAllPiecesInSight) {
  const auto map = compile_map(load_map("procedural:3"));
  const MapRules& rules = map->rules;
  const MapView view = rules.view();
  RandomStream random({.seed = 6, .purpose = Purpose::town});
  int in_far_corners = 0;
  for (int i = 0; i < 4000; ++i) {
    const LaneSegment& segment = rules.segments[random.below(static_cast<uint32_t>(rules.segments.size()))];
    const Vec2 aside{random.uniform(-8, 8), random.uniform(-8, 8)};
    const Vec2 at = segment.a_m.xy() + aside;
    const float heading_rad = random.uniform(-kPi, kPi);
    const EgoFrame frame{{at.x, at.y, 0}, {cos_of(heading_rad), sin_of(heading_rad)}};
    std::vector<uint8_t> is_listed(rules.boundary_pieces.size());
    for (const int32_t item : list_of(view.near_boundary_pieces, near_place(view, at, heading_rad).cell_and_sector)) {
      is_listed[item] = 1;
    }
    for (size_t k = 0; k < is_listed.size(); ++k) {
      if (!is_in_sight(rules.boundary_pieces[k], frame)) continue;
      const Vec2 local = frame.turn(rules.boundary_middles[k] - at);
      if (local.x > 115 && std::abs(local.y) > 20) ++in_far_corners;
      ASSERT_TRUE(is_listed[k]) << "piece " << k << " at " << local.x << ", " << local.y << " of place " << i;
    }
  }
  EXPECT_GT(in_far_corners, 1000);
}

TEST_F(Observation, PiecesAreAtMostTenMetresLong) {
  const MapRules& map = stage.worlds.setup.maps[0]->rules;
  const auto total_of = [](const std::vector<ObservedPiece>& pieces) {
    double total = 0;
    for (const ObservedPiece& piece : pieces) {
      EXPECT_LE(piece.half_length_m, 5.001f);
      total += 2 * piece.half_length_m;
    }
    return total;
  };
  // Two straights of 200 m and two half circles, of radius 20 m and 16 m; edges are 2 m beside either.
  const double lanes_m = 4 * 200 + kTwoPi * (20 + 16), edges_m = 4 * 200 + kTwoPi * (22 + 14);
  EXPECT_NEAR(total_of(map.lane_pieces), lanes_m, 0.01 * lanes_m);
  EXPECT_NEAR(total_of(map.boundary_pieces), edges_m, 0.01 * edges_m);
  EXPECT_NEAR(total_of(map.wall_pieces), 12.0 * static_cast<double>(map.walls.size()), 1e-3);
}

TEST_F(Observation, PiecesOfTheStraightRoad) {
  write_observation();
  const ObservationView out = stage.results.observation_view();
  const auto expect_row = [](Span<const float> rows, Vec2 at, float heading_rad, float extent) {
    const float expected[kLaneFeatures] = {
        at.x / 120, at.y / 120, 0, 5 / 5.0f, std::cos(heading_rad), std::sin(heading_rad), extent};
    const float* row = nullptr;
    for (size_t i = 0; i < rows.size() && !row; i += kLaneFeatures) {
      if (std::abs(rows[i] - expected[0]) < 1e-5 && std::abs(rows[i + 1] - expected[1]) < 1e-5) row = &rows[i];
    }
    ASSERT_NE(row, nullptr);
    for (int i = 0; i < kLaneFeatures; ++i) EXPECT_NEAR(row[i], expected[i], 1e-5) << i;
  };
  // Pieces from x = 110 to 120: both lanes, 4 m wide, and the edges, which have the road to their right.
  expect_row(out.lanes, local(115, 0), -0.1f, 4 / 5.0f);
  expect_row(out.lanes, local(115, 4), -0.1f, 4 / 5.0f);
  expect_row(out.boundaries, local(115, 6), -0.1f, 0);
  expect_row(out.boundaries, local(115, -2), kPi - 0.1f, 0);
}

TEST_F(Observation, WallsAreTheirPiecesWithTheirHeights) {
  write_observation();
  const ObservationView out = stage.results.observation_view();
  const std::vector<WallFace> walls = make_walls(*stage.worlds.setup.maps[0]->road, {.wall_seed = 0});
  ASSERT_GT(walls.size(), 2u);
  ASSERT_EQ(walls[0].a_m.x, 120);
  ASSERT_EQ(walls[0].b_m.x, 108);
  // The first wall stands from x = 120 to 108, 9 m south: two pieces of 6 m that point west, the road to their right.
  int found = 0;
  for (const float x : {117.0f, 111.0f}) {
    const Vec2 at = local(x, -9);
    const float expected[kWallFeatures] = {at.x / 120,
                                           at.y / 120,
                                           0.5f / 10,
                                           3 / 5.0f,
                                           std::cos(kPi - 0.1f),
                                           std::sin(kPi - 0.1f),
                                           walls[0].height_m / 12};
    for (int row = 0; row < out.set_counts[4]; ++row) {
      const float* r = out.walls.data() + row * kWallFeatures;
      if (std::abs(r[0] - expected[0]) > 1e-5) continue;
      ++found;
      for (int i = 0; i < kWallFeatures; ++i) EXPECT_NEAR(r[i], expected[i], 1e-5) << i;
    }
  }
  EXPECT_EQ(found, 2);
}

TEST_F(Observation, WallsAreObservedOnlyIfConfigured) {
  const auto map = make_map();
  EXPECT_TRUE(testing::Stage(map, 1).results.observation_view().walls.empty());
  SimulatorConfig config = testing::cars({.walls = false, .wall_observations = true});
  testing::Stage without(map, 1, config);
  without.put(0, {100, 0.5f}, 0.1f, 6);
  observe(without.world(), 0, 1, true, without.results.observation_view());
  EXPECT_EQ(without.results.observation_view().set_counts[4], 0);
  EXPECT_EQ(without.results.observation_view().walls.size(), size_t{kMaxWalls * kWallFeatures});
  config.vector_observations = false;
  EXPECT_TRUE(testing::Stage(map, 1, config).results.observation_view().walls.empty());
}

TEST_F(Observation, HaltedAgentsAreObservedButObserveNothing) {
  AgentState& agents = stage.worlds.state.agents;
  agents.status[1] = AgentStatus::halted;
  agents.events[1] = kEventNone;
  write_observation();
  const ObservationView out = stage.results.observation_view();
  EXPECT_NEAR(out.partners[0], local(108.8f, 4).x / 120, 1e-5);
  observe(stage.world(), 1, 2, true, out);
  for (size_t i = 0; i < kEgoFeatures; ++i) EXPECT_EQ(out.ego[kEgoFeatures + i], 0);
  for (size_t i = 0; i < kMaxLanes * kLaneFeatures; ++i) EXPECT_EQ(out.lanes[kMaxLanes * kLaneFeatures + i], 0);
  agents.events[1] = kEventCollision;  // the step in which the agent halted: its last observation
  observe(stage.world(), 1, 2, true, out);
  EXPECT_NE(out.ego[kEgoFeatures + 1], 0);
}

}  // namespace
}  // namespace pictura
