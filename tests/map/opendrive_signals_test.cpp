// Lights and signs: the lanes they control, stop lines, and positions of heads.
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "pictura/map/opendrive/opendrive.h"
#include "pictura/tests/map/small_roads.h"

namespace pictura {
namespace {

using test::expect_at;
using test::index_of;
using test::lane_named;
using test::lane_of;
using test::parse;
using test::RoadText;
using test::three_roads;

const std::string kController = R"(<controller id="90"><control signalId="50"/></controller>)";
const std::string kInJunction = R"(<controller id="90" type="0"/>)";

std::vector<int32_t> lanes_of(const RoadMap& map, const TrafficLight& light) {
  return {map.light_lanes.begin() + light.lanes.begin, map.light_lanes.begin() + light.lanes.end};
}

std::vector<int32_t> lanes_of(const RoadMap& map, const Sign& sign) {
  return {map.sign_lanes.begin() + sign.lanes.begin, map.sign_lanes.begin() + sign.lanes.end};
}

TEST(OpenDriveLights, StopLineHeadPhaseAndLanesFollowFromTheReferences) {
  const std::string signals =
      R"(<signals><signal id="50" type="1000001" s="18" t="-5" zOffset="-0.5" orientation="+"/>)"
      R"(<signal id="51" type="1000001" s="18" t="5" orientation="+"><validity fromLane="0" toLane="0"/></signal>)"
      R"(<signalReference id="50" s="12" t="0" orientation="+"><validity fromLane="-2" toLane="-1"/></signalReference>)"
      R"(</signals>)";
  const std::string controllers = R"(<controller id="90" sequence="3"><control signalId="50"/></controller>)"
                                  R"(<controller id="91" sequence="1"><control signalId="51"/></controller>)";
  const RoadMap map =
      parse(three_roads(signals, R"(<controller id="90" type="0"/><controller id="91" type="0"/>)") + controllers);
  ASSERT_EQ(map.lights.size(), 1u);  // 51 controls no lane
  const TrafficLight& light = map.lights[0];
  EXPECT_EQ(light.name, "50");
  EXPECT_EQ(light.junction, 0);
  EXPECT_EQ(light.phase, 1);
  EXPECT_EQ(map.junctions[0].num_phases, 2);
  expect_at(map, light.stop_a_m, 100, 0);
  expect_at(map, light.stop_b_m, 100, -6);
  EXPECT_NEAR(light.stop_heading_rad, 0, 1e-6);
  EXPECT_NEAR(light.head_facing.x, -1, 1e-6);
  EXPECT_NEAR(light.head_facing.y, 0, 1e-6);
  expect_at(map, light.head_m, 118, -5, 5.0);  // beyond the junction: 5.5 m above the foot of the post
  const std::vector<int32_t> expected = {
      index_of(map, lane_named(map, "1", 0, -1)), index_of(map, lane_named(map, "1", 0, -2)),
      index_of(map, lane_named(map, "2", 0, -1)), index_of(map, lane_named(map, "2", 0, -2))};
  EXPECT_EQ(
      std::vector<int32_t>(map.light_lanes.begin() + light.lanes.begin, map.light_lanes.begin() + light.lanes.end),
      expected);
}

TEST(OpenDriveLights, WithoutReferencesTheyControlTheirOwnRoadsLanes) {
  const std::string on_2 = R"(<signals><signal id="50" type="1000001" s="1" t="-7" orientation="+">)"
                           R"(<validity fromLane="-2" toLane="-2"/></signal></signals>)";
  const std::string on_1 = R"(<signals><signal id="50" type="1000001" s="60" t="-7" orientation="+">)"
                           R"(<validity fromLane="-2" toLane="-2"/></signal></signals>)";
  for (const RoadMap& map :
       {parse(three_roads(on_2, kInJunction) + kController), parse(three_roads("", kInJunction, on_1) + kController)}) {
    ASSERT_EQ(map.lights.size(), 1u);
    expect_at(map, map.lights[0].stop_a_m, 100, -3);
    expect_at(map, map.lights[0].stop_b_m, 100, -6);
    EXPECT_EQ(lanes_of(map, map.lights[0]), (std::vector<int32_t>{index_of(map, lane_named(map, "1", 0, -2)),
                                                                  index_of(map, lane_named(map, "2", 0, -2))}));
  }
}

TEST(OpenDriveLights, WithoutValidityTheyControlTheLanesOfTheirOrientation) {
  auto lights_with = [](const char* orientation) {
    return parse(three_roads("", kInJunction,
                             fmt::format(R"(<signals><signal id="50" type="1000001" s="99" t="-7" orientation="{}"/>)"
                                         R"(</signals>)",
                                         orientation)) +
                 kController)
        .lights;
  };
  ASSERT_EQ(lights_with("+").size(), 1u);
  EXPECT_EQ(lights_with("+")[0].lanes.size(), 4);
  EXPECT_EQ(lights_with("none").size(), 1u);
  EXPECT_EQ(lights_with("-").size(), 0u);
}

TEST(OpenDriveLights, WithoutAControllerOfAJunctionTheyAreSkipped) {
  const std::string light = R"(<signals><signal id="50" type="1000001" s="1" t="-7"/></signals>)";
  EXPECT_EQ(parse(three_roads(light)).lights.size(), 0u);
  EXPECT_EQ(parse(three_roads(light) + kController).lights.size(), 0u);
  EXPECT_EQ(parse(three_roads(light, kInJunction) + kController).lights.size(), 1u);
}

TEST(OpenDriveSigns, ApplyToTheLanesThatTheyNameAndFaceTheirTraffic) {
  RoadText road;
  road.left = lane_of(1, "driving", 3);
  road.right = lane_of(-1, "driving", 3) + lane_of(-2, "sidewalk", 2);
  road.rest =
      R"(<signals><signal id="1" type="206" subtype="-1" country="OpenDRIVE" s="90" t="-5" zOffset="2" orientation="+"/>)"
      R"(<signal id="2" type="205" s="10" t="5" orientation="+"><validity fromLane="1" toLane="1"/></signal>)"
      R"(<signal id="3" type="274" subtype="50" s="10" t="5" orientation="-"><validity fromLane="0" toLane="0"/></signal>)"
      R"(<signal id="4" type="206" s="20" t="5"/><signalReference id="4" s="50" t="0" orientation="-"/></signals>)";
  const RoadMap map = parse(road.text());
  ASSERT_EQ(map.signs.size(), 4u);
  EXPECT_EQ(map.facts.signs, 4);
  const int32_t left = index_of(map, lane_named(map, "1", 0, 1)), right = index_of(map, lane_named(map, "1", 0, -1));
  EXPECT_EQ(map.signs[0].name, "1");
  EXPECT_EQ(map.signs[0].type, "206");
  EXPECT_EQ(map.signs[0].country, "OpenDRIVE");
  expect_at(map, map.signs[0].position_m, 90, -5, 2);
  EXPECT_EQ(lanes_of(map, map.signs[0]), std::vector<int32_t>{right});
  EXPECT_NEAR(map.signs[0].heading_rad, 0, 1e-5);
  // Its orientation is wrong; the heading is that of its lane.
  EXPECT_EQ(lanes_of(map, map.signs[1]), std::vector<int32_t>{left});
  EXPECT_NEAR(std::abs(map.signs[1].heading_rad), M_PI, 1e-5);
  EXPECT_EQ(map.signs[2].subtype, "50");
  EXPECT_TRUE(lanes_of(map, map.signs[2]).empty());
  EXPECT_NEAR(std::abs(map.signs[2].heading_rad), M_PI, 1e-5);
  EXPECT_EQ(lanes_of(map, map.signs[3]), std::vector<int32_t>{left});
}

}  // namespace
}  // namespace pictura
