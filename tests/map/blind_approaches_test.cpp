// Occlusion by walls at a hand-made crossing compared with values computed by hand, and plausible counts in towns.
#include "pictura/map/blind_approaches.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "pictura/map/load_map.h"
#include "pictura/map/map_geometry.h"

namespace pictura {
namespace {

/// Two one-way roads of one lane that cross at the origin, eastwards and northwards. The junction extends 10 m from the
/// origin; the lanes before it begin at 50 m, in two pieces.
struct Crossing {
  Crossing() {
    map.junctions = {{"1", 0}};
    for (const bool east : {true, false}) {
      const int32_t first = static_cast<int32_t>(map.lanes.size());
      for (const float from : {-50.0f, -20.0f, -10.0f, 10.0f}) {
        const float to = from == -50.0f ? -20.0f : from == -20.0f ? -10.0f : -from + (from > 0 ? 60.0f : 0.0f);
        Lane lane;
        lane.type = LaneType::driving;
        lane.in_junction = from == -10.0f;
        lane.junction = lane.in_junction ? 0 : -1;
        lane.source_road = east ? 0 : 1;
        lane.length_m = to - from;
        lane.points.begin = static_cast<int32_t>(map.lane_points.size());
        for (const float s : {from, to}) {
          map.lane_points.push_back({east ? Vec3{s, 0, 0} : Vec3{0, s, 0}, east ? 0 : kHalfPi, 4, s - from});
        }
        lane.points.end = static_cast<int32_t>(map.lane_points.size());
        map.lanes.push_back(lane);
      }
      for (int32_t lane = first; lane + 1 < first + 4; ++lane) {
        add_link(&map.lanes[lane].successors, lane + 1);
        add_link(&map.lanes[lane + 1].predecessors, lane);
      }
    }
  }
  void add_link(IndexRange* range_out, int32_t lane) {
    range_out->begin = static_cast<int32_t>(map.lane_links.size());
    map.lane_links.push_back(lane);
    range_out->end = range_out->begin + 1;
  }

  RoadMap map;
};

/// A building in the corner between the approaches, its walls `clear_m` from both centre lines.
std::vector<WallFace> corner(float clear_m, float z_m = 0, float height_m = 4) {
  return {{{-48, -clear_m, z_m}, {-clear_m, -clear_m, z_m}, height_m},
          {{-clear_m, -clear_m, z_m}, {-clear_m, -48, z_m}, height_m}};
}

void expect_count(const BlindApproaches& count, int approaches, int blind, int crossings, int hidden) {
  EXPECT_EQ(count.approaches, approaches);
  EXPECT_EQ(count.blind, blind);
  EXPECT_EQ(count.crossings, crossings);
  EXPECT_EQ(count.hidden, hidden);
}

TEST(BlindApproaches, AWallInTheCornerHidesCrossingTraffic) {
  const RoadMap map = Crossing().map;
  expect_count(count_blind_approaches(map, {}), 2, 0, 2, 0);
  // The eye at (-30, 0) and the car at (0, -30): the line between them passes 15 m from either road.
  expect_count(count_blind_approaches(map, corner(6)), 2, 2, 2, 2);
  expect_count(count_blind_approaches(map, corner(16)), 2, 0, 2, 0);
  // The car's front right corner, (1, -27.75), is visible past a building that is 14.17 m from the centre lines.
  expect_count(count_blind_approaches(map, corner(14.1f)), 2, 2, 2, 2);
  expect_count(count_blind_approaches(map, corner(14.3f)), 2, 0, 2, 0);
  // Closer to the junction, the building no longer blocks the line between eye and car.
  expect_count(count_blind_approaches(map, corner(12), 20), 2, 2, 2, 2);
  expect_count(count_blind_approaches(map, corner(12), 10), 2, 0, 2, 0);
}

TEST(BlindApproaches, WallsHideOnlyOnTheirLevelAndInTheirDirection) {
  const RoadMap map = Crossing().map;
  expect_count(count_blind_approaches(map, corner(6, -20)), 2, 0, 2, 0);
  expect_count(count_blind_approaches(map, corner(6, 0, 0.5f)), 2, 0, 2, 0);  // lower than the line of sight
  // A short wall close to the eye at (-30, 0) hides the other car; from (0, -30), the car at (-30, 0) is visible beside
  // it.
  const std::vector<WallFace> short_wall{{{-28, -1.2f, 0}, {-24, -7.5f, 0}, 4}};
  expect_count(count_blind_approaches(map, short_wall), 2, 1, 2, 1);
}

TEST(BlindApproaches, AreFoundWithTheLanesOfHiddenTraffic) {
  const RoadMap map = Crossing().map;
  constexpr int32_t kEastwards = 1, kNorthwards = 5;  // the lanes that end at the junction
  EXPECT_TRUE(find_blind_crossings(map, {}).empty());
  const std::vector<BlindCrossing> both = find_blind_crossings(map, corner(6));
  ASSERT_EQ(both.size(), 2u);
  EXPECT_EQ(both[0].approach, kEastwards);
  EXPECT_EQ(both[0].other_approach, kNorthwards);
  EXPECT_EQ(both[1].approach, kNorthwards);
  EXPECT_EQ(both[1].other_approach, kEastwards);
  const std::vector<WallFace> short_wall{{{-28, -1.2f, 0}, {-24, -7.5f, 0}, 4}};
  const std::vector<BlindCrossing> one = find_blind_crossings(map, short_wall);
  ASSERT_EQ(one.size(), 1u);
  EXPECT_EQ(one[0].approach, kEastwards);
}

TEST(BlindApproaches, LanesThatBeginNearbyAreSkipped) {
  const RoadMap map = Crossing().map;
  expect_count(count_blind_approaches(map, corner(6), 40), 2, 2, 2, 2);
  expect_count(count_blind_approaches(map, corner(6), 41), 0, 0, 0, 0);
}

TEST(BlindApproaches, EveryTownHasSome) {
  const std::vector<std::string> towns = known_towns();
  if (towns.empty()) GTEST_SKIP() << "no towns: set PICTURA_DATA";
  for (const std::string& town : towns) {
    SCOPED_TRACE(town);
    const auto map = load_map(town);
    const BlindApproaches without = count_blind_approaches(*map, {}),
                          with = count_blind_approaches(*map, make_walls(*map, {}));
    EXPECT_EQ(without.blind + without.hidden, 0);
    EXPECT_EQ(with.approaches, without.approaches);
    EXPECT_GT(with.blind, 0);
    EXPECT_LE(with.blind, with.approaches);
    EXPECT_LE(with.hidden, with.crossings);
    EXPECT_GE(with.hidden, with.blind);
  }
}

}  // namespace
}  // namespace pictura
