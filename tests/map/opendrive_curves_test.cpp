// Cubic reference lines and banked roads compared with formulae that are evaluated by hand.
#include <cmath>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/common/error.h"
#include "pictura/common/scene.h"
#include "pictura/map/map_fields.h"
#include "pictura/map/opendrive/curves.h"
#include "pictura/map/opendrive/opendrive.h"
#include "pictura/tests/map/small_roads.h"

namespace pictura {
namespace {

using test::expect_at;
using test::file_of;
using test::lane_named;
using test::lane_of;
using test::parse;
using test::RoadText;

/// Length of the parabola v = u^2 / 100 from 0 to u.
double parabola_length(double u) { return 0.5 * u * std::sqrt(1 + u * u / 2500) + 25 * std::asinh(u / 50); }

/// A road along that parabola to u = 60, with a single lane centred on the reference line.
RoadText parabola(const std::string& cubic) {
  RoadText road;
  road.length = parabola_length(60);
  road.geometry = fmt::format(R"(<geometry s="0" x="0" y="0" hdg="0" length="{}">{}</geometry>)", road.length, cubic);
  road.lane_offset = R"(<laneOffset s="0" a="2" b="0" c="0" d="0"/>)";
  road.right = lane_of(-1, "driving", 4);
  return road;
}

TEST(OpenDriveCurves, TheSameParabolaAsPoly3AndBothParamPoly3) {
  const double length = parabola_length(60), scale = 60 / length;
  const std::string as_poly3 = R"(<poly3 a="0" b="0" c="0.01" d="0"/>)";
  const std::string normalized =
      R"(<paramPoly3 pRange="normalized" aU="0" bU="60" cU="0" dU="0" aV="0" bV="0" cV="36" dV="0"/>)";
  const std::string by_length =
      fmt::format(R"(<paramPoly3 pRange="arcLength" aU="0" bU="{}" cU="0" dU="0" aV="0" bV="0" cV="{}" dV="0"/>)",
                  scale, 0.01 * scale * scale);
  for (const std::string& cubic : {as_poly3, normalized, by_length}) {
    const RoadMap map = parse(parabola(cubic).text());
    const Span<const LanePoint> points = map.points_of(map.lanes[0]);
    ASSERT_GE(points.size(), 8u) << cubic;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double x = points[i].position_m.x + map.origin_m[0];
      expect_at(map, points[i].position_m, x, 0.01 * x * x);
      EXPECT_NEAR(points[i].heading_rad, std::atan(0.02 * x), 1e-5) << cubic;
      EXPECT_NEAR(points[i].s_m, parabola_length(x), 0.03) << cubic;
    }
    expect_at(map, points[points.size() - 1].position_m, 60, 36);
  }
}

TEST(OpenDriveCurves, StationsOnCubicsAreArcLengths) {
  // The second section begins at the s at which the parabola passes u = 40.
  RoadText road = parabola(R"(<poly3 a="0" b="0" c="0.01" d="0"/>)");
  road.sections = "<laneSection s=\"0\"><center/><right>" + lane_of(-1, "driving", 4) +
                  fmt::format("</right></laneSection><laneSection s=\"{}\"><center/><right>", parabola_length(40)) +
                  lane_of(-1, "driving", 4) + "</right></laneSection>";
  const RoadMap map = parse(road.text());
  expect_at(map, map.points_of(lane_named(map, "1", 1, -1))[0].position_m, 40, 16);
}

TEST(OpenDriveCurves, ACurveOfAnotherLengthThanItsGeometryKeepsItsShape) {
  // Twice as long as the curve: stations are those of the file, and the lane is as long as the curve.
  const RoadMap map = parse(
      parabola(R"(<paramPoly3 pRange="normalized" aU="0" bU="30" cU="0" dU="0" aV="0" bV="0" cV="9" dV="0"/>)").text());
  ASSERT_EQ(map.mends.size(), 1u);
  EXPECT_EQ(map.mends[0].kind, RepairKind::line_length);
  expect_at(map, map.lane_points.front().position_m, 0, 0);
  expect_at(map, map.lane_points.back().position_m, 30, 9);
  EXPECT_NEAR(map.lanes[0].length_m, parabola_length(30), 0.02);
  EXPECT_NEAR(map.facts.driving_lane_km, 1e-3 * parabola_length(60), 1e-4);
}

TEST(OpenDriveCurves, TheConsistentParameterRangeIsUsed) {
  const char* const curve = R"(<paramPoly3 pRange="{}" aU="0" bU="60" cU="0" dU="0" aV="0" bV="0" cV="36" dV="0"/>)";
  RoadMap map = parse(parabola(fmt::format(fmt::runtime(curve), "arcLength")).text());
  ASSERT_EQ(map.mends.size(), 1u);
  EXPECT_EQ(map.mends[0].kind, RepairKind::parameter_range);
  map.mends.clear();
  map.provenance = {};
  RoadMap same = parse(parabola(fmt::format(fmt::runtime(curve), "normalized")).text());
  same.provenance = {};
  EXPECT_EQ(first_difference(map, same), "");
}

TEST(OpenDriveCurves, AnUndefinedCurveIsRejected) {
  EXPECT_THROW(parse(parabola("<paramPoly3 pRange=\"normalized\"/>").text()), Error);
  EXPECT_THROW(
      parse(parabola(R"(<paramPoly3 pRange="metres" aU="0" bU="60" cU="0" dU="0" aV="0" bV="0" cV="36" dV="0"/>)")
                .text()),
      Error);
}

opendrive::Profile linear_profile(double at_start, double per_metre) { return {{{0, at_start, per_metre, 0, 0}}}; }

void expect_border(const opendrive::Border& border, double t, double slope) {
  EXPECT_NEAR(border.t, t, 1e-12);
  EXPECT_NEAR(border.slope, slope, 1e-12);
}

TEST(OpenDriveCurves, ALaneOfNegativeWidthNeitherMovesNorTurnsItsBorder) {
  opendrive::FileRoad road;
  road.lane_offset = linear_profile(0.5, 0.01);
  opendrive::FileSection section;
  section.end = 20;
  section.left.resize(2);
  section.left[0].width = linear_profile(1, -0.1);  // 0 at s = 10
  section.left[1].width = linear_profile(3, 0.02);
  expect_border(border_at(road, section, 1, 5), 0.55 + 0.5, 0.01 - 0.1);
  expect_border(border_at(road, section, 1, 15), 0.65, 0.01);
  expect_border(border_at(road, section, 2, 15), 0.65 + 3.3, 0.01 + 0.02);
}

TEST(OpenDriveCurves, ABorderInsideThePreviousOneCoincidesWithIt) {
  const opendrive::FileRoad road;
  opendrive::FileSection section;
  section.end = 20;
  section.right.resize(2);
  section.right[0].border = linear_profile(-3, -0.1);
  section.right[1].border = linear_profile(-4, 0.02);  // crosses the first border at s = 8.33
  expect_border(border_at(road, section, -2, 5), -3.9, 0.02);
  expect_border(border_at(road, section, -2, 15), -4.5, -0.1);
}

/// A straight road with lanes of 4 m on both sides and a sidewalk of 2 m on the right, with the banking in `lateral`.
RoadMap banked(const std::string& lateral, const std::string& sidewalk_attributes = "",
               const std::string& sidewalk_more = "") {
  RoadText road;
  road.lateral = lateral;
  road.left = lane_of(1, "driving", 4);
  road.right = lane_of(-1, "driving", 4) +
               fmt::format(R"(<lane id="-2" type="sidewalk"{}>{}<width sOffset="0" a="2" b="0" c="0" d="0"/></lane>)",
                           sidewalk_attributes, sidewalk_more);
  return parse(road.text());
}

Vec3 first_of(const RoadMap& map, int lane) { return map.points_of(lane_named(map, "1", 0, lane))[0].position_m; }

TEST(OpenDriveOffset, RaisesARoadAlsoBeforeItsFirstHeight) {
  test::RoadText road;
  road.right = test::lane_of(-1, "driving", 3);
  road.elevation = R"(<elevation s="40" a="2" b="0" c="0" d="0"/>)";
  const std::string text = test::replaced(test::file_of(road.text()), R"(<header revMajor="1" revMinor="4"/>)",
                                          R"(<header revMajor="1" revMinor="4"><offset x="0" y="0" z="50"/></header>)");
  const RoadMap map = parse_opendrive(text, "raised.xodr");
  EXPECT_FLOAT_EQ(map.lane_points.front().position_m.z, 50);
  EXPECT_FLOAT_EQ(map.lane_points.back().position_m.z, 52);
}

TEST(OpenDriveBanking, SuperelevationRotatesTheRoadAboutItsReferenceLine) {
  const RoadMap map = banked(R"(<superelevation s="0" a="0.1" b="0" c="0" d="0"/>)");
  const double c = std::cos(0.1), s = std::sin(0.1);
  expect_at(map, first_of(map, -1), 0, -2 * c, -2 * s);
  expect_at(map, first_of(map, -2), 0, -5 * c, -5 * s);
  // The left lane has the opposite direction: its last point is at s = 0.
  const Span<const LanePoint> left = map.points_of(lane_named(map, "1", 0, 1));
  expect_at(map, left[left.size() - 1].position_m, 0, 2 * c, 2 * s);
}

TEST(OpenDriveBanking, SuperelevationThatGrowsIsFollowedWithinTheChordError) {
  const RoadMap map = banked(R"(<superelevation s="0" a="0" b="0.004" c="0" d="0"/>)");
  for (const LanePoint& point : map.points_of(lane_named(map, "1", 0, -1))) {
    const double s = point.position_m.x + map.origin_m[0];
    expect_at(map, point.position_m, s, -2 * std::cos(0.004 * s), -2 * std::sin(0.004 * s));
  }
}

TEST(OpenDriveBanking, CrossfallFallsOutwardsOnItsSide) {
  const RoadMap map = banked(R"(<crossfall side="right" s="0" a="0.05" b="0" c="0" d="0"/>)");
  EXPECT_NEAR(first_of(map, -1).z, -2 * std::tan(0.05), 1e-5);
  EXPECT_NEAR(first_of(map, 1).z, 0, 1e-6);
  const RoadMap both = banked(R"(<crossfall side="both" s="0" a="0.05" b="0" c="0" d="0"/>)");
  EXPECT_NEAR(first_of(both, 1).z, -2 * std::tan(0.05), 1e-5);
}

TEST(OpenDriveBanking, ShapesAreLinearBetweenTheirStations) {
  // Flat at s = 0; at s = 100 it falls by 0.1 per metre to both sides of the centre.
  const RoadMap map =
      banked(R"(<shape s="0" t="-10" a="0" b="0" c="0" d="0"/><shape s="100" t="-10" a="-1" b="0.1" c="0" d="0"/>)"
             R"(<shape s="100" t="0" a="0" b="-0.1" c="0" d="0"/>)");
  const Span<const LanePoint> points = map.points_of(lane_named(map, "1", 0, -1));
  for (const LanePoint& point : points) {
    EXPECT_NEAR(point.position_m.z, -0.2 * (point.position_m.x + map.origin_m[0]) / 100, 1e-4);
  }
  EXPECT_NEAR(points[points.size() - 1].position_m.z, -0.2, 1e-5);
}

TEST(OpenDriveBanking, LevelLanesKeepTheHeightOfTheirInnerBorder) {
  const RoadMap map = banked(R"(<superelevation s="0" a="0.1" b="0" c="0" d="0"/>)", R"( level="true")");
  EXPECT_NEAR(first_of(map, -2).z, -4 * std::sin(0.1), 1e-5);
  expect_at(map, first_of(map, -1), 0, -2 * std::cos(0.1), -2 * std::sin(0.1));
}

TEST(OpenDriveBanking, LaneHeightsAreAdded) {
  const RoadMap map = banked("", "",
                             R"(<height sOffset="0" inner="0.1" outer="0.2"/>)"
                             R"(<roadMark sOffset="0" type="solid" color="white"/>)");
  EXPECT_NEAR(first_of(map, -2).z, 0.15, 1e-6);
  expect_at(map, map.marking_points[0], 0, -6, 0.2);
  EXPECT_NEAR(first_of(map, -1).z, 0, 1e-6);
}

TEST(OpenDriveBanking, RoadEdgesLieOnTheBankedRoad) {
  const RoadMap map = banked(R"(<superelevation s="0" a="0.1" b="0" c="0" d="0"/>)");
  ASSERT_FALSE(map.road_edges.empty());
  for (const RoadEdge& edge : map.road_edges) EXPECT_NEAR(edge.a_m.z, edge.a_m.y * std::tan(0.1), 1e-3);
}

TEST(OpenDriveBanking, CrossSectionsOfStripsAreFlattened) {
  RoadMap map = banked("<crossSectionSurface><tOffset><coefficients s=\"0\" a=\"0\"/></tOffset></crossSectionSurface>");
  ASSERT_EQ(map.mends.size(), 1u);
  EXPECT_THAT(map.mends[0].message, ::testing::HasSubstr("<crossSectionSurface>: cross-sections as strips"));
  EXPECT_EQ(map.mends[0].kind, RepairKind::strip_surface);
  map.mends.clear();
  RoadMap flat = banked("");
  for (RoadMap* each : {&map, &flat}) each->provenance = {};
  EXPECT_EQ(first_difference(map, flat), "");
}

}  // namespace
}  // namespace pictura
