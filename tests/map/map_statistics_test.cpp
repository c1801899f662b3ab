// Statistics of small hand-made maps.
#include "pictura/map/map_statistics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace pictura {
namespace {

using testing::DoubleNear;
using testing::Each;
using testing::ElementsAre;

/// Appends a lane of two points, which turns and climbs in between.
Lane& add_lane(RoadMap* map, float length_m, float width_m, float turn_rad, float climb_m) {
  const auto begin = static_cast<int32_t>(map->lane_points.size());
  map->lane_points.push_back({{0, 0, 0}, 0, width_m, 0});
  map->lane_points.push_back({{length_m, 0, climb_m}, turn_rad, width_m, length_m});
  Lane& lane = map->lanes.emplace_back();
  lane.type = LaneType::driving;
  lane.points = {begin, begin + 2};
  lane.length_m = length_m;
  return lane;
}

TEST(MapStatistics, AnEmptyMapHasZeros) {
  const MapStatistics statistics = map_statistics({});
  EXPECT_THAT(statistics.lane_width_m, Each(0));
  EXPECT_THAT(statistics.radius_shares, Each(0));
  EXPECT_THAT(statistics.head_ahead_m, Each(0));
}

TEST(MapStatistics, WeighLanesByLength) {
  RoadMap map;
  add_lane(&map, 60, 3, 0, 0).speed_limit_mps = 10;
  add_lane(&map, 30, 4, 1, 3).speed_limit_mps = 20;  // radius 30 m, 10 in 100 steep
  Lane& third = add_lane(&map, 10, 4, 1, 0);         // radius 10 m
  third.speed_limit_mps = 30;
  third.left_neighbor = 1;
  map.lanes[1].right_neighbor = 2;
  Lane& parking = add_lane(&map, 25, 2, 0, 0);
  parking.type = LaneType::parking;
  const MapStatistics statistics = map_statistics(map);
  EXPECT_THAT(statistics.lane_width_m, ElementsAre(3, 3, 4));
  EXPECT_THAT(statistics.speed_limit_mps, ElementsAre(10, 10, 30));
  EXPECT_THAT(statistics.lanes_shares, ElementsAre(DoubleNear(0.6, 1e-6), DoubleNear(0.4, 1e-6), 0, 0));
  EXPECT_THAT(statistics.radius_shares,
              ElementsAre(DoubleNear(0.1, 1e-6), DoubleNear(0.3, 1e-6), 0, DoubleNear(0.6, 1e-6)));
  EXPECT_NEAR(statistics.steep_share, 0.3, 1e-6);
  EXPECT_NEAR(statistics.parking_share, 0.25, 1e-6);
}

TEST(MapStatistics, CountRoadsAtJunctionsAndMeasureHeadDistances) {
  RoadMap map;
  map.junctions.resize(1);
  for (int i = 0; i < 5; ++i) {
    Lane& lane = add_lane(&map, 10, 3, 0, 0);
    lane.source_road = i;
  }
  map.lanes[4].junction = 0;
  map.lanes[4].in_junction = true;
  map.lanes[4].predecessors = {0, 2};
  map.lanes[4].successors = {2, 4};
  map.lane_links = {0, 1, 2, 3};
  TrafficLight light;
  light.stop_a_m = {5, 2, 0};
  light.stop_b_m = {5, -2, 0};
  light.head_m = {20, -4, 5};
  map.lights = {light};
  const MapStatistics statistics = map_statistics(map);
  EXPECT_THAT(statistics.junctions_of_arms, ElementsAre(0, 1, 0, 0));
  EXPECT_THAT(statistics.head_ahead_m, Each(15));
}

}  // namespace
}  // namespace pictura
