// Lane geometry of small OpenDRIVE files compared with coordinates computed by hand.
#include <cmath>
#include <map>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "pictura/common/scene.h"
#include "pictura/map/opendrive/opendrive.h"
#include "pictura/tests/map/small_roads.h"

namespace pictura {
namespace {

using test::expect_at;
using test::index_of;
using test::lane_named;
using test::lane_of;
using test::line_at;
using test::list;
using test::parse;
using test::RoadText;
using test::three_roads;

/// A road of two lanes of 4 m along x to 100, and a way back at its end: a half circle of this radius on the outside of
/// its lane, after straight pieces of the given length.
std::string turnaround(double radius, double straight) {
  RoadText street, way;
  street.link = R"(<successor elementType="junction" elementId="9"/>)";
  street.left = lane_of(1, "driving", 4);
  street.right = lane_of(-1, "driving", 4);
  way.id = "2";
  way.junction = "9";
  way.length = M_PI * radius + 2 * straight;
  way.link = R"(<predecessor elementType="road" elementId="1" contactPoint="end"/>)"
             R"(<successor elementType="road" elementId="1" contactPoint="end"/>)";
  way.geometry = line_at(0, 100, -radius, 0, straight) +
                 fmt::format(R"(<geometry s="{}" x="{}" y="{}" hdg="0" length="{}"><arc curvature="{}"/></geometry>)",
                             straight, 100 + straight, -radius, M_PI * radius, 1 / radius) +
                 line_at(straight + M_PI * radius, 100 + straight, radius, M_PI, straight);
  way.lane_offset = R"(<laneOffset s="0" a="4" b="0" c="0" d="0"/>)";
  way.right = lane_of(-1, "driving", 4, R"(<link><predecessor id="-1"/><successor id="1"/></link>)");
  return street.text() + way.text() +
         R"(<junction id="9"><connection id="0" incomingRoad="1" connectingRoad="2" contactPoint="start">)"
         R"(<laneLink from="-1" to="-1"/></connection></junction>)";
}

TEST(OpenDriveGeometry, ASelfOverlappingLaneHasNoRoadEdgeInside) {
  for (const double radius : {1.0, 2.0, 3.0, 3.9}) {
    for (const double straight : {1.0, 6.0}) {
      const RoadMap map = parse(turnaround(radius, straight));
      for (const RoadEdge& edge : map.road_edges) {
        const double x = 0.5 * (edge.a_m.x + edge.b_m.x) + map.origin_m[0];
        const double y = 0.5 * (edge.a_m.y + edge.b_m.y) + map.origin_m[1];
        // Ground enclosed by the way's reference line.
        const double beyond = std::max(x - 100 - straight, 0.0);
        EXPECT_FALSE(x > 100.1 && std::hypot(beyond, y) < radius - 0.1)
            << "radius " << radius << ", straight " << straight << ": an edge at (" << x << ", " << y << ")";
      }
    }
  }
}

TEST(OpenDriveGeometry, LanesOfALineRunInTheDirectionOfTravel) {
  RoadText road;
  road.geometry = line_at(0, 10, 20, M_PI / 6, 100);
  road.right = lane_of(-1, "driving", 4);
  road.left = lane_of(1, "driving", 3);
  const RoadMap map = parse(road.text());
  ASSERT_EQ(map.lanes.size(), 2u);
  const double c = std::sqrt(3.0) / 2, s = 0.5;

  const Span<const LanePoint> right = map.points_of(lane_named(map, "1", 0, -1));
  expect_at(map, right[0].position_m, 10 + 2 * s, 20 - 2 * c);
  expect_at(map, right[right.size() - 1].position_m, 10 + 100 * c + 2 * s, 20 + 100 * s - 2 * c);
  EXPECT_NEAR(right[0].heading_rad, M_PI / 6, 1e-6);
  EXPECT_FLOAT_EQ(right[0].width_m, 4);

  const Span<const LanePoint> left = map.points_of(lane_named(map, "1", 0, 1));
  expect_at(map, left[0].position_m, 10 + 100 * c - 1.5 * s, 20 + 100 * s + 1.5 * c);
  expect_at(map, left[left.size() - 1].position_m, 10 - 1.5 * s, 20 + 1.5 * c);
  EXPECT_NEAR(left[0].heading_rad, M_PI / 6 - M_PI, 1e-6);
  EXPECT_NEAR(lane_named(map, "1", 0, 1).length_m, 100, 1e-3);
  for (std::size_t i = 1; i < left.size(); ++i) EXPECT_LE(left[i].s_m - left[i - 1].s_m, kMaxPiece_m + 1e-3f);
}

TEST(OpenDriveGeometry, ArcLanesKeepTheirRadiusWithinTheChordError) {
  // A quarter turn to the left with radius 50 about (0, 50); the right lane's centre has radius 52.
  RoadText road;
  road.length = 25 * M_PI;
  road.geometry =
      fmt::format(R"(<geometry s="0" x="0" y="0" hdg="0" length="{}"><arc curvature="0.02"/></geometry>)", road.length);
  road.right = lane_of(-1, "driving", 4);
  const RoadMap map = parse(road.text());
  const Span<const LanePoint> points = map.points_of(map.lanes[0]);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double x = points[i].position_m.x + map.origin_m[0], y = points[i].position_m.y + map.origin_m[1] - 50;
    EXPECT_NEAR(std::hypot(x, y), 52, 1e-4);
    EXPECT_NEAR(wrap_angle(points[i].heading_rad - static_cast<float>(std::atan2(y, x) + M_PI / 2)), 0, 1e-5);
    if (i == 0) continue;
    const double x0 = points[i - 1].position_m.x + map.origin_m[0],
                 y0 = points[i - 1].position_m.y + map.origin_m[1] - 50;
    EXPECT_GE(std::hypot(0.5 * (x + x0), 0.5 * (y + y0)), 52 - 0.02);
  }
  expect_at(map, points[points.size() - 1].position_m, 52, 50);
  EXPECT_NEAR(map.lanes[0].length_m, 26 * M_PI, 0.1);
  EXPECT_LT(points.size(), 60u);
}

TEST(OpenDriveGeometry, SpiralMatchesItsSeries) {
  // Curvature 0 to 0.02 over 100 m turns by 1 rad. Ends of a clothoid by the series of the Fresnel integrals:
  // x = L (1 - 1/10 + 1/216 - 1/9360 + 1/685440), y = L (1/3 - 1/42 + 1/1320 - 1/75600 + 1/6894720).
  const double x = 100 * (1 - 1.0 / 10 + 1.0 / 216 - 1.0 / 9360 + 1.0 / 685440);
  const double y = 100 * (1.0 / 3 - 1.0 / 42 + 1.0 / 1320 - 1.0 / 75600 + 1.0 / 6894720);
  RoadText road;
  road.geometry =
      R"(<geometry s="0" x="0" y="0" hdg="0" length="100"><spiral curvStart="0" curvEnd="0.02"/></geometry>)";
  road.right = lane_of(-1, "driving", 4);
  const RoadMap map = parse(road.text());
  const LanePoint end = map.lane_points[static_cast<std::size_t>(map.lanes[0].points.end) - 1];
  expect_at(map, end.position_m, x + 2 * std::sin(1), y - 2 * std::cos(1));
  EXPECT_NEAR(end.heading_rad, 1, 1e-5);
}

TEST(OpenDriveGeometry, OffsetsWidthsAndHeightsFollowTheirCubics) {
  RoadText road;
  road.lane_offset = R"(<laneOffset s="0" a="1" b="0.01" c="0" d="0"/><laneOffset s="60" a="1.6" b="0" c="0" d="0"/>)";
  road.elevation = R"(<elevation s="0" a="2" b="0.1" c="-0.001" d="0"/>)";
  road.right = R"(<lane id="-1" type="driving"><width sOffset="0" a="3" b="0" c="0.001" d="-0.00001"/></lane>)"
               R"(<lane id="-2" type="parking"><width sOffset="0" a="2" b="0" c="0" d="0"/></lane>)";
  const RoadMap map = parse(road.text());
  auto offset = [](double s) { return s < 60 ? 1 + 0.01 * s : 1.6; };
  auto width = [](double s) { return 3 + 0.001 * s * s - 0.00001 * s * s * s; };
  auto z = [](double s) { return 2 + 0.1 * s - 0.001 * s * s; };
  const Lane &driving = lane_named(map, "1", 0, -1), &parking = lane_named(map, "1", 0, -2);
  for (const Lane* lane : {&driving, &parking}) {
    const Span<const LanePoint> points = map.points_of(*lane);
    ASSERT_GE(points.size(), 10u);
    auto center = [&](double s) { return lane == &driving ? offset(s) - 0.5 * width(s) : offset(s) - width(s) - 1; };
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double s = points[i].position_m.x + map.origin_m[0];
      expect_at(map, points[i].position_m, s, center(s), z(s));
      EXPECT_NEAR(points[i].width_m, lane == &driving ? width(s) : 2, 1e-4);
      if (i == 0) continue;
      const double s0 = points[i - 1].position_m.x + map.origin_m[0], middle = 0.5 * (s + s0);
      EXPECT_NEAR(0.5 * (center(s) + center(s0)), center(middle), 0.021);
      EXPECT_NEAR(0.5 * (z(s) + z(s0)), z(middle), 0.021);
    }
    EXPECT_NEAR(points[3].heading_rad, 0, 0.1);
  }
}

TEST(OpenDriveGeometry, CoordinatesAreKeptFarFromTheFilesOrigin) {
  RoadText road;
  road.geometry = line_at(0, 4.5e6, -7.25e6, 0, 100);
  road.right = lane_of(-1, "driving", 3);
  const RoadMap map = parse(road.text());
  expect_at(map, map.lane_points[0].position_m, 4.5e6, -7.25e6 - 1.5);
}

TEST(OpenDriveLanes, SectionsAreLinkedAndNeighboursAreAdjacent) {
  RoadText road;
  const std::string left = lane_of(1, "driving", 3, R"(<link><successor id="1"/></link>)");
  road.sections = "<laneSection s=\"0\"><left>" + lane_of(1, "driving", 3, R"(<link><successor id="2"/></link>)") +
                  "</left><center/><right>" + lane_of(-1, "driving", 3, R"(<link><successor id="-1"/></link>)") +
                  lane_of(-2, "driving", 3, R"(<link><successor id="-2"/></link>)") + lane_of(-3, "shoulder", 1) +
                  "</right></laneSection>\n<laneSection s=\"40\"><left>" + lane_of(1, "driving", 0.5) +
                  lane_of(2, "driving", 3, R"(<link><predecessor id="1"/></link>)") + "</left><center/><right>" +
                  lane_of(-1, "driving", 3) + lane_of(-2, "driving", 3) + "</right></laneSection>\n";
  const RoadMap map = parse(road.text());
  const Lane &a1 = lane_named(map, "1", 0, -1), &a2 = lane_named(map, "1", 0, -2), &b1 = lane_named(map, "1", 1, -1);
  EXPECT_EQ(list(map, a1.successors), std::vector<int32_t>{index_of(map, b1)});
  EXPECT_EQ(list(map, b1.predecessors), std::vector<int32_t>{index_of(map, a1)});
  EXPECT_EQ(a1.right_neighbor, index_of(map, a2));
  EXPECT_EQ(a2.left_neighbor, index_of(map, a1));
  EXPECT_EQ(a1.left_neighbor, -1);
  EXPECT_EQ(a2.right_neighbor, -1);  // a shoulder
  // On the left side, traffic runs from the second section into the first, and the outer lane is on its right.
  const Lane &left_a = lane_named(map, "1", 0, 1), &left_b = lane_named(map, "1", 1, 2);
  EXPECT_EQ(list(map, left_b.successors), std::vector<int32_t>{index_of(map, left_a)});
  EXPECT_EQ(left_b.left_neighbor, index_of(map, lane_named(map, "1", 1, 1)));
  EXPECT_NEAR(a1.length_m, 40, 1e-3);
  EXPECT_NEAR(b1.length_m, 60, 1e-3);
}

TEST(OpenDriveLanes, ASectionOfAMicrometreIsRemoved) {
  RoadText road;
  auto section = [](const char* s, const char* link) {
    return fmt::format("<laneSection s=\"{}\"><center/><right>{}</right></laneSection>\n", s,
                       lane_of(-1, "driving", 3, link));
  };
  road.sections = section("0", R"(<link><successor id="-1"/></link>)") +
                  section("50", R"(<link><predecessor id="-1"/><successor id="-1"/></link>)") +
                  section("50.000001", R"(<link><predecessor id="-1"/></link>)");
  const RoadMap map = parse(road.text());
  ASSERT_EQ(map.lanes.size(), 2u);
  EXPECT_EQ(list(map, map.lanes[0].successors), std::vector<int32_t>{1});
  EXPECT_NEAR(map.lanes[0].length_m + map.lanes[1].length_m, 100, 1e-3);
}

TEST(OpenDriveLanes, TypesOfAllVersionsAreKnown) {
  const std::map<std::string, LaneType> types = {
      {"driving", LaneType::driving},     {"bidirectional", LaneType::bidirectional},
      {"entry", LaneType::ramp},          {"exit", LaneType::ramp},
      {"onRamp", LaneType::ramp},         {"offRamp", LaneType::ramp},
      {"connectingRamp", LaneType::ramp}, {"parking", LaneType::parking},
      {"stop", LaneType::stop},           {"restricted", LaneType::restricted},
      {"biking", LaneType::biking},       {"curb", LaneType::border},
      {"walking", LaneType::sidewalk},    {"sidewalk", LaneType::sidewalk},
      {"median", LaneType::median},       {"special1", LaneType::other},
      {"shoulder", LaneType::shoulder}};
  for (const auto& [name, type] : types) {
    RoadText road;
    road.right = lane_of(-1, name, 3);
    const RoadMap map = parse(road.text());
    ASSERT_EQ(map.lanes.size(), 1u);
    EXPECT_EQ(map.lanes[0].type, type) << name;
  }
  RoadText road;
  road.right = lane_of(-1, "none", 3) + lane_of(-2, "sidewalk", 3);
  const RoadMap map = parse(road.text());
  ASSERT_EQ(map.lanes.size(), 1u);
  expect_at(map, map.lane_points[0].position_m, 0, -4.5);
}

TEST(OpenDriveLanes, JunctionLanesAreLinkedAndInheritTheirSpeedLimit) {
  const RoadMap map = parse(three_roads());
  const Lane &a = lane_named(map, "1", 0, -2), &b = lane_named(map, "2", 0, -2), &c = lane_named(map, "3", 0, -2);
  EXPECT_EQ(list(map, a.successors), std::vector<int32_t>{index_of(map, b)});
  EXPECT_EQ(list(map, b.predecessors), std::vector<int32_t>{index_of(map, a)});
  EXPECT_EQ(list(map, b.successors), std::vector<int32_t>{index_of(map, c)});
  EXPECT_EQ(list(map, c.predecessors), std::vector<int32_t>{index_of(map, b)});
  EXPECT_TRUE(b.in_junction);
  EXPECT_EQ(b.junction, 0);
  EXPECT_FALSE(a.in_junction);
  EXPECT_NEAR(a.speed_limit_mps, 10, 1e-5);
  EXPECT_NEAR(b.speed_limit_mps, 10, 1e-5);
  EXPECT_FALSE(a.is_endless);
  EXPECT_EQ(map.facts.roads, 3);
  EXPECT_EQ(map.facts.junction_roads, 1);
  EXPECT_NEAR(map.facts.driving_lane_km, 0.44, 1e-9);
  EXPECT_NEAR(map.facts.driving_lane_km_in_junctions, 0.04, 1e-9);
}

TEST(OpenDriveLanes, SpeedUnits) {
  for (const auto& [speed, expected] : std::map<std::string, double>{{R"(max="25" unit="mph")", 11.176},
                                                                     {R"(max="50" unit="km/h")", 13.8889},
                                                                     {R"(max="12")", 12},
                                                                     {R"(max="no limit")", 15}}) {
    RoadText road;
    road.type = "<type s=\"0\" type=\"town\"><speed " + speed + "/></type>";
    road.right = lane_of(-1, "driving", 3);
    EXPECT_NEAR(parse(road.text()).lanes[0].speed_limit_mps, expected, 1e-3) << speed;
  }
}

TEST(OpenDriveLanes, LanesWithAccessToARingAreEndlessAndDeadEndsAreNot) {
  // A circular road of radius 20, linked to itself; only the outer of its two lanes is linked.
  RoadText ring;
  ring.length = 40 * M_PI;
  ring.geometry =
      fmt::format(R"(<geometry s="0" x="0" y="0" hdg="0" length="{}"><arc curvature="0.05"/></geometry>)", ring.length);
  ring.link = R"(<predecessor elementType="road" elementId="1" contactPoint="end"/>)"
              R"(<successor elementType="road" elementId="1" contactPoint="start"/>)";
  ring.right = lane_of(-1, "driving", 3) + lane_of(-2, "driving", 3, R"(<link><successor id="-2"/></link>)");
  RoadText dead_end;
  dead_end.id = "2";
  dead_end.geometry = line_at(0, 100, 100, 0, 100);
  dead_end.right = lane_of(-1, "driving", 3);
  const RoadMap map = parse(ring.text() + dead_end.text());
  EXPECT_TRUE(lane_named(map, "1", 0, -2).is_endless);
  EXPECT_TRUE(lane_named(map, "1", 0, -1).is_endless);
  EXPECT_FALSE(lane_named(map, "2", 0, -1).is_endless);
}

}  // namespace
}  // namespace pictura
