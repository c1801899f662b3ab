// Lanes and links: borders, one-sided sections, speed limits, direct junctions, left-hand traffic, the header.
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <tuple>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/common/error.h"
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

TEST(OpenDriveLanes, BordersAreOffsetsFromTheReferenceLine) {
  RoadText road;
  road.right = R"(<lane id="-1" type="driving"><border sOffset="0" a="-3" b="-0.01" c="0" d="0"/></lane>)"
               R"(<lane id="-2" type="driving"><border sOffset="0" a="-7" b="0" c="0" d="0"/></lane>)";
  road.left = R"(<lane id="1" type="driving"><border sOffset="0" a="4" b="0" c="0" d="0"/></lane>)";
  const RoadMap map = parse(road.text());
  for (const LanePoint& point : map.points_of(lane_named(map, "1", 0, -1))) {
    const double s = point.position_m.x + map.origin_m[0];
    EXPECT_NEAR(point.width_m, 3 + 0.01 * s, 1e-4);
    expect_at(map, point.position_m, s, -0.5 * (3 + 0.01 * s));
    EXPECT_NEAR(point.heading_rad, -std::atan(0.005), 1e-5);
  }
  const LanePoint outer = map.points_of(lane_named(map, "1", 0, -2))[0];
  expect_at(map, outer.position_m, 0, -5);
  EXPECT_FLOAT_EQ(outer.width_m, 4);
  EXPECT_FLOAT_EQ(map.points_of(lane_named(map, "1", 0, 1))[0].width_m, 4);
  // Crossing borders give a negative width, which counts as zero.
  road.right = R"(<lane id="-1" type="driving"><border sOffset="0" a="-3" b="0.1" c="0" d="0"/></lane>)";
  const RoadMap crossed = parse(road.text());
  ASSERT_EQ(crossed.mends.size(), 1u);
  EXPECT_EQ(crossed.mends[0].kind, RepairKind::negative_width);
}

TEST(OpenDriveLanes, WidthsOverrideBorders) {
  RoadText road;
  road.right = R"(<lane id="-1" type="driving"><width sOffset="0" a="3" b="0" c="0" d="0"/>)"
               R"(<border sOffset="0" a="-9" b="0" c="0" d="0"/></lane>)";
  EXPECT_FLOAT_EQ(parse(road.text()).lane_points[0].width_m, 3);
}

TEST(OpenDriveLanes, OneSidedSectionsContinueTheOtherSide) {
  auto linked = [](int id, const char* link) { return lane_of(id, "driving", 3, link); };
  RoadText road;
  road.sections = "<laneSection s=\"0\"><left>" + linked(1, R"(<link><successor id="1"/></link>)") +
                  "</left><center/><right><lane id=\"-1\" type=\"driving\"><link><successor id=\"-1\"/></link>"
                  "<width sOffset=\"0\" a=\"3\" b=\"0.02\" c=\"0\" d=\"0\"/></lane></right></laneSection>" +
                  "<laneSection s=\"30\" singleSide=\"true\"><left>" +
                  linked(1, R"(<link><predecessor id="1"/><successor id="1"/></link>)") + linked(2, "") +
                  "</left><center/></laneSection>" + "<laneSection s=\"60\"><left>" +
                  linked(1, R"(<link><predecessor id="1"/></link>)") + "</left><center/><right>" +
                  linked(-1, R"(<link><predecessor id="-1"/></link>)") + "</right></laneSection>";
  const RoadMap map = parse(road.text());
  // Four lanes of the left side and two of the right side, the first of which is split at 30.
  EXPECT_EQ(map.facts.lanes, 6);
  EXPECT_EQ(map.lanes.size(), 7u);
  int32_t at = index_of(map, lane_named(map, "1", 0, -1));
  double s = 0;
  for (int piece = 0; piece < 3; ++piece) {
    const Lane& lane = map.lanes[at];
    const LanePoint begin = map.points_of(lane)[0];
    EXPECT_NEAR(begin.position_m.x + map.origin_m[0], s, 1e-4);
    if (piece < 2) {
      EXPECT_EQ(lane.source_section, 0);
      EXPECT_NEAR(begin.width_m, 3 + 0.02 * s, 1e-4);
      ASSERT_EQ(list(map, lane.successors).size(), 1u);
      at = list(map, lane.successors)[0];
    }
    s += 30;
  }
  EXPECT_EQ(index_of(map, lane_named(map, "1", 2, -1)), at);
  EXPECT_EQ(list(map, lane_named(map, "1", 1, 1).successors),
            std::vector<int32_t>{index_of(map, lane_named(map, "1", 0, 1))});
}

TEST(OpenDriveLanes, ALaneIsCutWhereItsSpeedLimitChanges) {
  RoadText road;
  road.type = R"(<type s="0" type="town"><speed max="10" unit="m/s"/></type>)"
              R"(<type s="40" type="rural"><speed max="20"/></type>)";
  road.right = lane_of(-1, "driving", 3) + lane_of(-2, "driving", 3, R"(<speed sOffset="70" max="36" unit="km/h"/>)");
  road.center_mark = R"(<roadMark sOffset="0" type="solid" color="white"/>)";
  const RoadMap map = parse(road.text());
  EXPECT_EQ(map.facts.lanes, 2);
  EXPECT_EQ(map.facts.driving_lanes, 2);
  EXPECT_NEAR(map.facts.driving_lane_km, 0.2, 1e-9);
  ASSERT_EQ(map.lanes.size(), 6u);
  const double limits[2][3] = {{10, 20, 20}, {10, 20, 10}}, begins[3] = {0, 40, 70};
  for (int id = 1; id <= 2; ++id) {
    int32_t at = index_of(map, lane_named(map, "1", 0, -id));
    for (int piece = 0; piece < 3; ++piece) {
      const Lane& lane = map.lanes[at];
      EXPECT_NEAR(lane.speed_limit_mps, limits[id - 1][piece], 1e-4) << id << " " << piece;
      EXPECT_NEAR(map.points_of(lane)[0].position_m.x + map.origin_m[0], begins[piece], 1e-4);
      EXPECT_EQ((id == 1 ? map.lanes[lane.right_neighbor].left_neighbor : map.lanes[lane.left_neighbor].right_neighbor),
                at);
      if (piece < 2) at = list(map, lane.successors).at(0);
    }
  }
  double painted_m = 0;
  for (const Vec3 p : map.marking_points) painted_m = std::max(painted_m, p.x + map.origin_m[0]);
  EXPECT_NEAR(painted_m, 100, 1e-3);
}

TEST(OpenDriveLanes, DirectionsOfLanesMayDifferFromTheirSide) {
  RoadText road;
  road.left = R"(<lane id="1" type="driving" direction="reversed"><width sOffset="0" a="3" b="0" c="0" d="0"/></lane>)";
  road.right = lane_of(-1, "driving", 3) +
               R"(<lane id="-2" type="driving" direction="both"><width sOffset="0" a="3" b="0" c="0" d="0"/></lane>)";
  const RoadMap map = parse(road.text());
  const Lane &left = lane_named(map, "1", 0, 1), &right = lane_named(map, "1", 0, -1);
  expect_at(map, map.points_of(left)[0].position_m, 0, 1.5);
  EXPECT_EQ(right.left_neighbor, index_of(map, left));
  EXPECT_EQ(left.right_neighbor, index_of(map, right));
  EXPECT_EQ(lane_named(map, "1", 0, -2).type, LaneType::bidirectional);
}

TEST(OpenDriveLanes, DirectJunctionsLinkRoadsDirectly) {
  RoadText main, on, exit;
  main.link = R"(<successor elementType="junction" elementId="7"/>)";
  main.right = lane_of(-1, "driving", 3) + lane_of(-2, "exit", 3);
  on.id = "2";
  on.link = R"(<predecessor elementType="junction" elementId="7"/>)";
  on.geometry = line_at(0, 100, 0, 0, 100);
  on.right = lane_of(-1, "driving", 3);
  exit.id = "3";
  exit.link = on.link;
  exit.geometry = line_at(0, 100, -3, -0.1, 100);
  exit.right = lane_of(-1, "driving", 3);
  const RoadMap map = parse(
      main.text() + on.text() + exit.text() +
      R"(<junction id="7" type="direct"><connection id="0" incomingRoad="1" linkedRoad="2" contactPoint="start">)"
      R"(<laneLink from="-1" to="-1"/></connection><connection id="1" incomingRoad="1" linkedRoad="3" contactPoint="start">)"
      R"(<laneLink from="-2" to="-1"/></connection></junction>)");
  EXPECT_EQ(list(map, lane_named(map, "1", 0, -1).successors),
            std::vector<int32_t>{index_of(map, lane_named(map, "2", 0, -1))});
  EXPECT_EQ(list(map, lane_named(map, "1", 0, -2).successors),
            std::vector<int32_t>{index_of(map, lane_named(map, "3", 0, -1))});
  EXPECT_EQ(map.facts.junction_roads, 0);
}

TEST(OpenDriveHeader, TheOffsetRotatesAndTranslatesTheMap) {
  RoadText road;
  road.geometry = line_at(0, 10, 5, 0, 100);
  road.right = lane_of(-1, "driving", 4);
  const RoadMap map = parse_opendrive(
      "<OpenDRIVE><header><geoReference><![CDATA[+proj=utm +zone=32]]></geoReference>"
      R"(<offset x="1000" y="2000" z="30" hdg="1.5707963267948966"/></header>)" +
          road.text() + "</OpenDRIVE>",
      "geo.xodr");
  EXPECT_EQ(map.geo_reference, "+proj=utm +zone=32");
  // (10, 5 - 2) rotated by 90 degrees is (-3, 10).
  expect_at(map, map.lane_points[0].position_m, 1000 - 3, 2000 + 10, 30);
  EXPECT_NEAR(map.lane_points[0].heading_rad, M_PI / 2, 1e-5);
}

TEST(OpenDriveProvenance, EveryElementHasItsRoadAndLine) {
  RoadText road;
  road.id = "12";
  road.center_mark = "\n<roadMark sOffset=\"0\" type=\"solid\" color=\"white\"/>";
  road.right = lane_of(-1, "driving", 3);
  road.rest =
      "<objects>\n<object id=\"1\" type=\"crosswalk\" s=\"10\" t=\"0\" length=\"2\" width=\"6\"/>\n"
      "<object id=\"2\" type=\"parking\" s=\"10\" t=\"-6\" length=\"5\" width=\"2\"/>\n"
      "<object id=\"3\" type=\"stopLine\" s=\"90\" t=\"0\" length=\"0.4\" width=\"6\"/>\n</objects>"
      "<signals>\n<signal id=\"4\" type=\"206\" s=\"90\" t=\"-4\"/>\n</signals>";
  const std::string text = test::file_of(road.text() + "<junction id=\"5\"/>");
  const RoadMap map = parse_opendrive(text, "small.xodr");
  auto line_of = [&](const std::string& needle) {
    return 1 + static_cast<int32_t>(std::count(text.begin(), text.begin() + static_cast<int>(text.find(needle)), '\n'));
  };
  auto expect_from = [&](const std::vector<SourceElement>& sources, std::size_t count, int road_index, int line) {
    ASSERT_EQ(sources.size(), count);
    EXPECT_EQ(sources[0].road, road_index);
    EXPECT_EQ(sources[0].line, line);
  };
  const Provenance& from = map.provenance;
  expect_from(from.lanes, map.lanes.size(), 0, line_of("<lane id=\"-1\""));
  expect_from(from.markings, map.markings.size(), 0, line_of("<roadMark"));
  expect_from(from.crosswalks, 1, 0, line_of("<object id=\"1\""));
  expect_from(from.parking_spaces, 1, 0, line_of("<object id=\"2\""));
  expect_from(from.stop_lines, 1, 0, line_of("<object id=\"3\""));
  expect_from(from.signs, 1, 0, line_of("<signal id=\"4\""));
  expect_from(from.junctions, 1, -1, line_of("<junction"));
  expect_from(from.road_edges, map.road_edges.size(), 0, 0);
  expect_from(from.building_lines, map.building_lines.size(), 0, 0);
}

/// A bend with two lanes per direction, parking and a sign, which leads through a junction with a light into a straight
/// road; or its mirror image about the x axis, with left-hand traffic.
std::string bend(bool mirrored) {
  const int m = mirrored ? -1 : 1;
  auto side = [&](int road) {
    auto link = [&](int lane) {
      return road == 2 ? fmt::format(R"(<link><predecessor id="{0}"/><successor id="{0}"/></link>)", lane) : "";
    };
    auto lanes = [&](int sign) {
      std::string text;
      for (int k = 1; k <= 2; ++k) {
        text += fmt::format(R"(<lane id="{0}" type="driving">{1}<width sOffset="0" a="{2}" b="0.004" c="0" d="0"/>)"
                            R"(<roadMark sOffset="5" type="broken solid" color="white" width="0.1"/></lane>)",
                            sign * k, link(sign * k), 3 + 0.25 * k + (sign * m > 0 ? 0.1 : 0));
      }
      return text;
    };
    return std::pair(lanes(1), lanes(-1));
  };
  RoadText a, b, c;
  for (RoadText* road : {&a, &b, &c}) {
    road->rule = mirrored ? "LHT" : "RHT";
    road->lane_offset = fmt::format(R"(<laneOffset s="0" a="{}" b="0" c="0" d="0"/>)", 0.3 * m);
    road->center_mark =
        fmt::format(R"(<roadMark sOffset="0" type="{}" color="yellow"/>)", mirrored ? "broken solid" : "solid broken");
  }
  std::tie(a.left, a.right) = side(1);
  std::tie(b.left, b.right) = side(2);
  std::tie(c.left, c.right) = side(3);
  a.length = 50 * 1.2;
  a.geometry =
      fmt::format(R"(<geometry s="0" x="0" y="0" hdg="0" length="60"><arc curvature="{}"/></geometry>)", 0.02 * m);
  const double x = 50 * std::sin(1.2), y = 50 * (1 - std::cos(1.2)), dx = std::cos(1.2), dy = std::sin(1.2);
  a.link = R"(<successor elementType="junction" elementId="7"/>)";
  a.lateral = fmt::format(R"(<superelevation s="0" a="{}" b="0" c="0" d="0"/>)", 0.05 * m);
  a.rest = fmt::format(R"(<objects><object id="1" type="parking" s="30" t="{}" hdg="0" length="5" width="2"/>)"
                       R"(<object id="2" type="parking" s="30" t="{}" hdg="0" length="5" width="2"/></objects>)",
                       9 * m, -9 * m);
  b.id = "2";
  b.junction = "7";
  b.length = 20;
  b.geometry = line_at(0, x, y * m, 1.2 * m, 20);
  b.link = R"(<predecessor elementType="road" elementId="1" contactPoint="end"/>)"
           R"(<successor elementType="road" elementId="3" contactPoint="start"/>)";
  b.rest = fmt::format(
      R"(<signals><signal id="50" type="1000001" s="18" t="{0}" zOffset="0" orientation="+"/>)"
      R"(<signal id="51" type="206" s="2" t="{1}" zOffset="2" orientation="-"/>)"
      R"(<signalReference id="50" s="1" t="0" orientation="+"><validity fromLane="{2}" toLane="{3}"/></signalReference>)"
      R"(</signals>)",
      -8 * m, 8 * m, -2 * m, -1 * m);
  c.id = "3";
  c.geometry = line_at(0, x + 20 * dx, (y + 20 * dy) * m, 1.2 * m, 100);
  c.link = R"(<predecessor elementType="junction" elementId="7"/>)";
  return a.text() + b.text() + c.text() +
         fmt::format(R"(<junction id="7"><connection id="0" incomingRoad="1" connectingRoad="2" contactPoint="start">)"
                     R"(<laneLink from="{0}" to="{0}"/><laneLink from="{1}" to="{1}"/></connection>)"
                     R"(<controller id="90"/></junction><controller id="90"><control signalId="50"/></controller>)",
                     -1 * m, -2 * m);
}

TEST(OpenDriveLeftHand, AMirroredFileGivesTheMirroredMap) {
  const RoadMap map = parse(bend(false)), other = parse(bend(true));
  auto expect_mirrored = [&](Vec3 a, Vec3 b) {
    EXPECT_NEAR(a.x + map.origin_m[0], b.x + other.origin_m[0], 1e-3);
    EXPECT_NEAR(a.y + map.origin_m[1], -(b.y + other.origin_m[1]), 1e-3);
    EXPECT_NEAR(a.z, b.z, 1e-3);
  };
  auto mirror_index = [&](int32_t lane) {
    if (lane < 0) return -1;
    const Lane& original = map.lanes[lane];
    return index_of(
        other, lane_named(other, map.road_names[original.source_road], original.source_section, -original.source_lane));
  };
  auto mirror_indices = [&](const std::vector<int32_t>& lanes) {
    std::vector<int32_t> result;
    for (const int32_t lane : lanes) result.push_back(mirror_index(lane));
    std::sort(result.begin(), result.end());
    return result;
  };
  ASSERT_EQ(map.lanes.size(), 12u);
  ASSERT_EQ(other.lanes.size(), 12u);
  for (std::size_t i = 0; i < map.lanes.size(); ++i) {
    const Lane &lane = map.lanes[i], &mirror = other.lanes[mirror_index(static_cast<int32_t>(i))];
    ASSERT_EQ(lane.points.size(), mirror.points.size());
    for (std::size_t k = 0; k < map.points_of(lane).size(); ++k) {
      const LanePoint &p = map.points_of(lane)[k], &q = other.points_of(mirror)[k];
      expect_mirrored(p.position_m, q.position_m);
      EXPECT_NEAR(wrap_angle(p.heading_rad + q.heading_rad), 0, 1e-4);
      EXPECT_NEAR(p.width_m, q.width_m, 1e-4);
    }
    EXPECT_EQ(mirror_index(lane.left_neighbor), mirror.right_neighbor);
    EXPECT_EQ(mirror_index(lane.right_neighbor), mirror.left_neighbor);
    EXPECT_EQ(mirror_indices(list(map, lane.successors)), list(other, mirror.successors));
    EXPECT_EQ(mirror_indices(list(map, lane.predecessors)), list(other, mirror.predecessors));
  }
  // Left-hand traffic: lane 1 runs along s, with lane 2 on its left.
  const Lane& first = lane_named(other, "3", 0, 1);
  EXPECT_EQ(first.left_neighbor, index_of(other, lane_named(other, "3", 0, 2)));
  EXPECT_NEAR(other.points_of(first)[0].heading_rad, -1.2, 0.01);

  ASSERT_EQ(map.lights.size(), 1u);
  ASSERT_EQ(other.lights.size(), 1u);
  expect_mirrored(map.lights[0].stop_a_m, other.lights[0].stop_b_m);
  expect_mirrored(map.lights[0].stop_b_m, other.lights[0].stop_a_m);
  expect_mirrored(map.lights[0].head_m, other.lights[0].head_m);
  ASSERT_EQ(map.signs.size(), 1u);
  ASSERT_EQ(other.signs.size(), 1u);
  expect_mirrored(map.signs[0].position_m, other.signs[0].position_m);
  EXPECT_NEAR(wrap_angle(map.signs[0].heading_rad + other.signs[0].heading_rad), 0, 1e-4);
  EXPECT_EQ(map.signs[0].lanes.size(), 2);
  EXPECT_EQ(other.signs[0].lanes.size(), 2);

  ASSERT_EQ(map.parking_spaces.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    expect_mirrored(map.parking_spaces[i].center_m, other.parking_spaces[i].center_m);
    EXPECT_NEAR(wrap_angle(map.parking_spaces[i].heading_rad + other.parking_spaces[i].heading_rad), 0, 1e-4);
  }

  auto painted = [](const RoadMap& of, double sign) {
    std::vector<std::array<long, 4>> ends;
    for (const Marking& marking : of.markings) {
      const Vec3 a = of.marking_points[marking.points.begin];
      const Vec3 b = of.marking_points[static_cast<std::size_t>(marking.points.end) - 1];
      auto cm = [](double value) { return std::lround(value * 50); };
      ends.push_back({cm(a.x + of.origin_m[0]), cm(sign * (a.y + of.origin_m[1])), cm(b.x + of.origin_m[0]),
                      cm(sign * (b.y + of.origin_m[1]))});
    }
    std::sort(ends.begin(), ends.end());
    return ends;
  };
  EXPECT_EQ(painted(map, 1), painted(other, -1));
  auto edge_m = [](const RoadMap& of) {
    double sum = 0;
    for (const RoadEdge& edge : of.road_edges) sum += length(edge.b_m - edge.a_m);
    return sum;
  };
  EXPECT_NEAR(edge_m(map), edge_m(other), 0.1);
}

}  // namespace
}  // namespace pictura
