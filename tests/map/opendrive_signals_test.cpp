// Lights and signs: the lanes that they control, stop lines, and positions of heads.
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <fmt/format.h>
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
  ASSERT_EQ(map.lights.size(), 1u);  // light 51 controls no lane
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

/// Kinds of the repairs of a map.
std::vector<RepairKind> kinds_of(const RoadMap& map) {
  std::vector<RepairKind> kinds;
  for (const Repair& repair : map.mends) kinds.push_back(repair.kind);
  return kinds;
}

std::string light(const std::string& id, double s, double t, const std::string& orientation = "+") {
  return fmt::format(R"(<signal id="{}" type="1000001" s="{}" t="{}" zOffset="4" dynamic="yes" orientation="{}"/>)", id,
                     s, t, orientation);
}

TEST(OpenDriveLights, ALightOnARoadIsIndependent) {
  const auto ring_of = [](const std::string& lights) {
    return parse(test::ring_with("", [&](RoadText* road) { road->rest = "<signals>" + lights + "</signals>"; }));
  };
  const RoadMap map = ring_of(light("7", 100, -5));
  EXPECT_EQ(kinds_of(map), std::vector<RepairKind>{RepairKind::uncontrolled_light});
  ASSERT_EQ(map.lights.size(), 1u);
  const TrafficLight& alone = map.lights[0];
  EXPECT_EQ(alone.junction, -1);
  EXPECT_EQ(alone.phase, 0);
  const double angle = 100.0 / 40;
  expect_at(map, alone.stop_a_m, 40 * std::sin(angle), -40 * std::cos(angle));
  expect_at(map, alone.stop_b_m, 43.5 * std::sin(angle), -43.5 * std::cos(angle));
  EXPECT_NEAR(alone.stop_heading_rad, angle, 1e-5);
  // The lane is cut at the line; it counts once.
  EXPECT_EQ(map.facts.driving_lanes, 2);
  ASSERT_EQ(lanes_of(map, alone).size(), 2u);
  EXPECT_NEAR(map.lanes[lanes_of(map, alone)[0]].length_m, 41.75 * angle, 0.01);
  for (const Lane& lane : map.lanes) EXPECT_TRUE(lane.is_endless);
  // Heads on both sides and beyond share one line; the next line has its own light.
  EXPECT_EQ(ring_of(light("7", 60, -5) + light("8", 60.2, 2) + light("9", 75, -5)).lights.size(), 1u);
  EXPECT_EQ(ring_of(light("7", 60, -5) + light("8", 100, -5)).lights.size(), 2u);
  // At an end of its road, the line is at that end.
  EXPECT_EQ(ring_of(light("7", 0.1, -5)).lights.size(), 1u);
  EXPECT_EQ(ring_of(light("7", 40 * std::numbers::pi, -5)).lights.size(), 1u);
  const RoadMap nothing = ring_of(light("7", 100, -5, "-"));
  EXPECT_EQ(nothing.lights.size(), 0u);
  EXPECT_EQ(kinds_of(nothing), std::vector<RepairKind>{RepairKind::laneless_light});
}

TEST(OpenDriveLights, ALightForBothDirectionsHasTwoStopLines) {
  RoadText road;
  road.left = lane_of(1, "driving", 3);
  road.right = lane_of(-1, "driving", 3);
  road.rest = "<signals>" + light("7", 50, -5, "none") + "</signals>";
  const RoadMap map = parse(road.text());
  ASSERT_EQ(map.lights.size(), 2u);
  expect_at(map, map.lights[0].stop_a_m, 50, 0);  // first the light against s
  expect_at(map, map.lights[0].stop_b_m, 50, 3);
  expect_at(map, map.lights[1].stop_a_m, 50, 0);
  expect_at(map, map.lights[1].stop_b_m, 50, -3);
}

TEST(OpenDriveLights, ALightOfLanesWithoutWidthIsLeftOut) {
  RoadText road;
  road.right = R"(<lane id="-1" type="driving"><width sOffset="0" a="3" b="-0.06" c="0" d="0"/></lane>)";
  road.rest = "<signals>" + light("7", 50, -5) + "</signals>";
  const RoadMap map = parse(road.text());
  EXPECT_EQ(map.lights.size(), 0u);
}

/// A junction at the origin to which roads w, e and s lead, each with a light and a way straight on.
std::string crossing(const std::string& more_on_w, const std::string& junction_more = "") {
  std::string roads, connections;
  for (const auto& [name, heading] :
       std::vector<std::pair<std::string, double>>{{"w", 0}, {"e", std::numbers::pi}, {"s", 0.5 * std::numbers::pi}}) {
    const double x = std::cos(heading), y = std::sin(heading);
    RoadText in, through, out;
    for (RoadText* road : {&in, &through, &out}) road->right = lane_of(-1, "driving", 3);
    in.id = name;
    in.geometry = test::line_at(0, -110 * x, -110 * y, heading, 100);
    in.link = R"(<successor elementType="junction" elementId="7"/>)";
    in.rest = "<signals>" + light(name, 95, -5) + (name == "w" ? more_on_w : "") + "</signals>";
    through.id = name + " through";
    through.junction = "7";
    through.length = 20;
    through.geometry = test::line_at(0, -10 * x, -10 * y, heading, 20);
    through.link = fmt::format(R"(<predecessor elementType="road" elementId="{}" contactPoint="end"/>)"
                               R"(<successor elementType="road" elementId="{} out" contactPoint="start"/>)",
                               name, name);
    through.right = lane_of(-1, "driving", 3, R"(<link><predecessor id="-1"/><successor id="-1"/></link>)");
    out.id = name + " out";
    out.geometry = test::line_at(0, 10 * x, 10 * y, heading, 100);
    out.link = R"(<predecessor elementType="junction" elementId="7"/>)";
    roads += in.text() + through.text() + out.text();
    connections += fmt::format(R"(<connection id="{}" incomingRoad="{}" connectingRoad="{} through" )"
                               R"(contactPoint="start"><laneLink from="-1" to="-1"/></connection>)",
                               name, name, name);
  }
  return roads + "<junction id=\"7\">" + connections + junction_more + "</junction>";
}

TEST(OpenDriveLights, WithoutControllersLightsOfAJunctionCycleByHeading) {
  const RoadMap map = parse(crossing(light("second head", 99, 3)));
  EXPECT_EQ(kinds_of(map), std::vector<RepairKind>(4, RepairKind::uncontrolled_light));
  ASSERT_EQ(map.lights.size(), 3u);
  EXPECT_EQ(map.junctions.at(0).num_phases, 2);
  for (const TrafficLight& each : map.lights) {
    EXPECT_EQ(each.junction, 0);
    EXPECT_EQ(each.phase, each.name == "s" ? 1 : 0) << each.name;
    EXPECT_EQ(lanes_of(map, each).size(), 2u);
  }
  expect_at(map, map.lights[0].stop_a_m, -10, 0);
}

TEST(OpenDriveLights, LightsMissingFromJunctionControllersAreLeftOut) {
  const RoadMap map =
      parse(crossing("", R"(<controller id="90"/>)") + R"(<controller id="90"><control signalId="w"/></controller>)");
  ASSERT_EQ(map.lights.size(), 1u);
  EXPECT_EQ(map.lights[0].name, "w");
  EXPECT_EQ(kinds_of(map), std::vector<RepairKind>(2, RepairKind::unlisted_light));
}

TEST(OpenDriveSigns, ApplyToTheirLanesAndFaceTheirTraffic) {
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
  // The orientation of the sign is wrong; its heading is that of its lane.
  EXPECT_EQ(lanes_of(map, map.signs[1]), std::vector<int32_t>{left});
  EXPECT_NEAR(std::abs(map.signs[1].heading_rad), M_PI, 1e-5);
  EXPECT_EQ(map.signs[2].subtype, "50");
  EXPECT_TRUE(lanes_of(map, map.signs[2]).empty());
  EXPECT_NEAR(std::abs(map.signs[2].heading_rad), M_PI, 1e-5);
  EXPECT_EQ(lanes_of(map, map.signs[3]), std::vector<int32_t>{left});
}

}  // namespace
}  // namespace pictura
