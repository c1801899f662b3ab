// Faults with only one sensible meaning. By default, each fault is repaired and recorded. Strict reading instead throws
// an Error with file, line, owner and element.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <set>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/map/map_fields.h"
#include "pictura/map/opendrive/opendrive.h"
#include "pictura/map/repairs.h"
#include "pictura/tests/map/small_roads.h"
#include "pictura/tests/support/error_message.h"

namespace pictura {
namespace {

using test::file_of;
using test::index_of;
using test::lane_named;
using test::lane_of;
using test::line_at;
using test::list;
using test::replaced;
using test::ring_with;
using test::RoadText;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

/// Imports a file whose faults are all of one kind, apart from missing links that follow from omissions. Strict reading
/// must refuse the file with the message of a repair.
RoadMap repaired(const std::string& contents, RepairKind kind, std::size_t count = 1) {
  const std::string text = file_of(contents);
  RoadMap map = parse_opendrive(text, "bad.xodr");
  std::erase_if(map.mends, [kind](const Repair& repair) {
    return repair.kind == RepairKind::missing_link && kind != repair.kind;
  });
  const std::vector<std::string> described = describe_repairs(map.mends, "bad.xodr");
  EXPECT_EQ(described.size(), 1u) << fmt::format("{}", fmt::join(described, "\n"));
  std::set<std::string> messages;
  for (const Repair& repair : map.mends) messages.insert(message_of(repair, "bad.xodr"));
  EXPECT_EQ(map.mends.size(), count) << to_string(kind) << "\n" << fmt::format("{}", fmt::join(messages, "\n"));
  for (const Repair& repair : map.mends) EXPECT_STREQ(to_string(repair.kind), to_string(kind)) << repair.message;
  const std::string refusal = test::message_of([&] { parse_opendrive(text, "bad.xodr", {.strict = true}); });
  EXPECT_TRUE(messages.contains(refusal)) << to_string(kind) << ": " << refusal;
  EXPECT_THAT(refusal, StartsWith("bad.xodr:"));
  return map;
}

/// Returns the message of the only repair.
std::string said(const RoadMap& map) { return map.mends.empty() ? "" : message_of(map.mends.front(), "bad.xodr"); }

RoadText straight(const std::string& right = lane_of(-1, "driving", 3)) {
  RoadText road;
  road.right = right;
  return road;
}

/// Returns the map of a valid road, without repairs.
RoadMap sound(const std::string& contents) {
  RoadMap map = parse_opendrive(file_of(contents), "bad.xodr", {.strict = true});
  EXPECT_THAT(map.mends, IsEmpty());
  return map;
}

/// Returns the difference of two maps, apart from sources.
std::string difference(RoadMap a, RoadMap b) {
  for (RoadMap* map : {&a, &b}) {
    map->mends.clear();
    map->provenance = {};
  }
  return first_difference(a, b);
}

LanePoint first_point(const RoadMap& map, const Lane& lane) { return map.points_of(lane)[0]; }
LanePoint last_point(const RoadMap& map, const Lane& lane) {
  return map.lane_points[static_cast<std::size_t>(lane.points.end) - 1];
}

std::string width(double s, double a, double b = 0) {
  return fmt::format(R"(<width sOffset="{}" a="{}" b="{}" c="0" d="0"/>)", s, a, b);
}

std::string lane_with(const std::string& contents, int id = -1, const std::string& type = "driving") {
  return fmt::format("<lane id=\"{}\" type=\"{}\">{}</lane>\n", id, type, contents);
}

std::string shape(double s, double t, double a, double b = 0) {
  return fmt::format(R"(<shape s="{}" t="{}" a="{}" b="{}" c="0" d="0"/>)", s, t, a, b);
}

// Records along s.

TEST(OpenDriveRepairs, ShapesComeInAnyOrderOfT) {
  RoadText road = straight(lane_of(-1, "driving", 3)), sorted = road;
  road.left = sorted.left = lane_of(1, "driving", 3);
  road.lateral = shape(0, 0, 0.2) + shape(0, -9, 0.1) + shape(50, 0, 0.3) + shape(50, -9, 0.5);
  sorted.lateral = shape(0, -9, 0.1) + shape(0, 0, 0.2) + shape(50, -9, 0.5) + shape(50, 0, 0.3);
  const RoadMap map = repaired(road.text(), RepairKind::record_order, 2);
  EXPECT_THAT(said(map), HasSubstr("road 1: <shape>: attribute t: expected at least the previous one's 0, got -9"));
  EXPECT_EQ(difference(map, sound(sorted.text())), "");
}

TEST(OpenDriveRepairs, RecordsOutOfOrderAreSorted) {
  const auto map_of = [](const std::string& widths, const std::string& offsets, const std::string& speeds,
                         const std::string& heights, bool is_repaired) {
    RoadText road = straight(lane_with(widths + heights + speeds));
    road.lane_offset = offsets;
    return is_repaired ? repaired(road.text(), RepairKind::record_order, 4) : sound(road.text());
  };
  const std::string offset = R"(<laneOffset s="{}" a="{}" b="0" c="0" d="0"/>)";
  const std::string offset_0 = R"(<laneOffset s="0" a="0.5" b="0" c="0" d="0"/>)";
  const std::string offset_40 = R"(<laneOffset s="40" a="0.5" b="0.01" c="0" d="0"/>)";
  const std::string offset_41 = R"(<laneOffset s="40.0000001" a="0.5" b="0" c="0" d="0"/>)";
  const std::string speed_0 = R"(<speed sOffset="0" max="10"/>)", speed_60 = R"(<speed sOffset="60" max="20"/>)";
  const std::string height_0 = R"(<height sOffset="0" inner="0" outer="0.1"/>)",
                    height_30 = R"(<height sOffset="30" inner="0.1" outer="0.2"/>)";
  const RoadMap map = map_of(width(50, 4) + width(0, 3), offset_0 + offset_41 + offset_40, speed_60 + speed_0,
                             height_30 + height_0, true);
  EXPECT_EQ(difference(map, map_of(width(0, 3) + width(50, 4), offset_0 + offset_40 + offset_41, speed_0 + speed_60,
                                   height_0 + height_30, false)),
            "");
}

TEST(OpenDriveRepairs, RecordsBeyondTheEndAreLeftOut) {
  RoadText road = straight(lane_with(width(0, 3) + width(130, 9) +
                                     R"(<speed sOffset="130" max="1"/>)"
                                     R"(<height sOffset="130" inner="1" outer="1"/>)"));
  road.lane_offset = R"(<laneOffset s="100.5" a="7" b="0" c="0" d="0"/>)";
  road.type = R"(<type s="125" type="town"><speed max="3"/></type>)";
  const RoadMap map = repaired(road.text(), RepairKind::record_beyond_end, 5);
  EXPECT_THAT(said(map), HasSubstr("road 1: <type>: attribute s: expected a number in [0, 100], got 125"));
  EXPECT_EQ(difference(map, sound(straight().text())), "");
}

TEST(OpenDriveRepairs, RecordsBeforeTheStartApplyFromThere) {
  const RoadMap map = repaired(straight(lane_with(width(-2, 3) + R"(<speed sOffset="-1" max="9"/>)")).text(),
                               RepairKind::record_before_start, 2);
  EXPECT_FLOAT_EQ(map.lane_points.front().width_m, 3);
  EXPECT_FLOAT_EQ(map.lanes.front().speed_limit_mps, 9);
}

TEST(OpenDriveRepairs, MarksBeforeTheirSectionApplyFromItsStart) {
  const auto road_with = [](const std::string& offset) {
    return straight(lane_with(width(0, 3) + "<roadMark sOffset=\"" + offset + "\" type=\"broken\" color=\"white\"/>"))
        .text();
  };
  const RoadMap map = repaired(road_with("-2"), RepairKind::record_before_start);
  EXPECT_FALSE(map.markings.empty());
  EXPECT_FALSE(sound(road_with("0")).markings.empty());
  EXPECT_FALSE(sound(road_with("-1e-9")).markings.empty()) << "rounded";
}

TEST(OpenDriveRepairs, WidthsBeginWithTheirSection) {
  const RoadMap map = repaired(straight(lane_with(width(4, 3, 0.01))).text(), RepairKind::late_width);
  EXPECT_FLOAT_EQ(map.lane_points.front().width_m, 3);
  EXPECT_NEAR(map.lane_points.back().width_m, 3.96, 1e-3);
}

TEST(OpenDriveRepairs, ALaneWithoutWidthHasNoSurface) {
  const RoadMap map =
      repaired(straight(lane_of(-1, "driving", 3) + lane_with("", -2, "shoulder")).text(), RepairKind::missing_width);
  EXPECT_EQ(map.lanes.size(), 1u);
  EXPECT_EQ(map.facts.lanes, 1);
}

TEST(OpenDriveRepairs, WidthsBelowZeroCountAsZero) {
  const RoadMap map = repaired(straight(lane_with(width(0, 3) + width(50, 3, -0.1)) + lane_of(-2, "driving", 3)).text(),
                               RepairKind::negative_width);
  EXPECT_THAT(said(map), HasSubstr("road 1: <lane>: its width at s"));
  for (const LanePoint& point : map.lane_points) EXPECT_GE(point.width_m, 0);
  const Lane& inner = lane_named(map, "1", 0, -1);
  EXPECT_EQ(last_point(map, inner).width_m, 0);
  EXPECT_FLOAT_EQ(last_point(map, lane_named(map, "1", 0, -2)).width_m, 3);
  // A lane beside a section of the other side continues there, but its fault is counted once.
  RoadText road;
  road.sections = "<laneSection s=\"0\"><left>" + lane_of(1, "driving", 3, R"(<link><successor id="1"/></link>)") +
                  "</left><center/><right>" + lane_with(width(0, 3) + width(5, -0.5)) + "</right></laneSection>" +
                  "<laneSection s=\"30\" singleSide=\"true\"><left>" +
                  lane_of(1, "driving", 3, R"(<link><predecessor id="1"/></link>)") + "</left><center/></laneSection>";
  repaired(road.text(), RepairKind::negative_width);
}

TEST(OpenDriveRepairs, MissingCoefficientsAndHeightsAreZero) {
  RoadText road = straight(lane_with(R"(<width sOffset="0" a="3"/><height sOffset="0" outer="0"/>)"));
  road.geometry = R"(<geometry s="0" x="0" y="0" hdg="0" length="100"><spiral/></geometry>)";
  const RoadMap map = repaired(road.text(), RepairKind::missing_zero, 6);
  const RoadMap same = sound(straight(lane_with(width(0, 3) + R"(<height sOffset="0" inner="0" outer="0"/>)")).text());
  EXPECT_EQ(difference(map, same), "");
}

// Sections and lanes.

TEST(OpenDriveRepairs, SectionsAreSortedAndBeginWithTheRoad) {
  const std::string before = R"(<predecessor id="-1"/>)", after = R"(<successor id="-1"/>)";
  const auto section = [](double s, double lane_width, const std::string& link = "") {
    return fmt::format("<laneSection s=\"{}\"><center/><right>{}</right></laneSection>\n", s,
                       lane_of(-1, "driving", lane_width, "<link>" + link + "</link>"));
  };
  RoadText road;
  road.sections = section(0, 3, after) + section(60, 5, before) + section(30, 4, before + after);
  RoadMap map = repaired(road.text(), RepairKind::record_order);
  ASSERT_EQ(map.lanes.size(), 3u);
  EXPECT_FLOAT_EQ(first_point(map, map.lanes[1]).width_m, 4);
  EXPECT_THAT(list(map, map.lanes[1].successors), ElementsAre(2));
  road.sections = section(0, 3) + section(120, 4);
  EXPECT_EQ(repaired(road.text(), RepairKind::record_beyond_end).lanes.size(), 1u);
  road.sections = section(0.2, 3);
  EXPECT_FLOAT_EQ(repaired(road.text(), RepairKind::late_section).lanes[0].length_m, 100);
  road.sections = section(5, 3);
  EXPECT_THAT(test::message_of([&] { parse_opendrive(file_of(road.text()), "bad.xodr"); }),
              HasSubstr("road 1: <laneSection>: attribute s: expected the first section at 0, got 5"));
}

TEST(OpenDriveRepairs, GapsInLaneIdsAreFilled) {
  const RoadMap map =
      repaired(straight(lane_of(-1, "driving", 3) + lane_of(-4, "driving", 3) + lane_of(-2, "driving", 3)).text(),
               RepairKind::lane_gap);
  EXPECT_EQ(map.lanes.size(), 3u);
  EXPECT_FLOAT_EQ(first_point(map, lane_named(map, "1", 0, -4)).position_m.y + static_cast<float>(map.origin_m[1]),
                  -7.5f);
}

TEST(OpenDriveRepairs, TheCenterLaneIsZero) {
  const RoadMap map = repaired(replaced(straight().text(), "<lane id=\"0\"", "<lane id=\"3\""), RepairKind::center_id);
  EXPECT_EQ(difference(map, sound(straight().text())), "");
}

// Reference lines.

/// Road 3 of a ring.
RoadText between_the_halves(double length, double drawn) {
  RoadText road;
  road.id = "3";
  road.length = length;
  road.geometry = line_at(0, 0, 40, std::numbers::pi, drawn);
  road.link = R"(<predecessor elementType="road" elementId="1" contactPoint="end"/>)"
              R"(<successor elementType="road" elementId="2" contactPoint="start"/>)";
  road.right = lane_of(-1, "driving", 3.5, R"(<link><predecessor id="-1"/><successor id="-1"/></link>)");
  return road;
}

int num_endless(const RoadMap& map) {
  return static_cast<int>(
      std::count_if(map.lanes.begin(), map.lanes.end(), [](const Lane& lane) { return lane.is_endless; }));
}

TEST(OpenDriveRepairs, RoadsOfNoLengthAreAMillimetreLong) {
  RoadText road = straight();
  road.length = 1e-5;
  EXPECT_NEAR(repaired(road.text(), RepairKind::short_road).lanes[0].length_m, 1e-3, 1e-6);
  road.length = 0;
  EXPECT_EQ(repaired(road.text(), RepairKind::short_road).lanes.size(), 1u);
}

TEST(OpenDriveRepairs, ProfilesOfRoadsOfNoLengthAreConstant) {
  RoadText road = between_the_halves(2e-10, 2e-10);
  road.elevation = R"(<elevation s="0" a="0.5" b="-0.008" c="-4e9" d="1.5e19"/>)"
                   R"(<elevation s="1e-10" a="-700" b="0" c="0" d="0"/>)";
  road.lateral = R"(<superelevation s="0" a="0" b="9e9" c="0" d="0"/>)";
  road.lane_offset = R"(<laneOffset s="0" a="0" b="-3e6" c="0" d="4e18"/>)";
  road.right = lane_with(R"(<link><predecessor id="-1"/><successor id="-1"/></link>)" + width(0, 3.5, 7e12));
  const RoadMap map = repaired(ring_with(road.text()), RepairKind::short_road);
  const Lane& lane = lane_named(map, "3", 0, -1);
  EXPECT_EQ(num_endless(map), 3);
  EXPECT_FLOAT_EQ(first_point(map, lane).width_m, 3.5);
  EXPECT_FLOAT_EQ(last_point(map, lane).width_m, 3.5);
  EXPECT_NEAR(last_point(map, lane).position_m.z, 0.5, 1e-6);
  EXPECT_EQ(map.facts.z_max_m, 0.5);
  EXPECT_EQ(map.facts.z_min_m, 0);
}

TEST(OpenDriveRepairs, RoadsWithZeroLengthGeometryHaveNoLength) {
  const RoadMap map = repaired(ring_with(between_the_halves(0.1, 0).text()), RepairKind::short_road);
  EXPECT_EQ(num_endless(map), 3);
  EXPECT_NEAR(map.facts.driving_lane_km, 0.251, 1e-3);
  EXPECT_THAT(said(map), HasSubstr("road 3: <road>: attribute length: expected at least 0.001 with <geometry>, got 0"));
}

TEST(OpenDriveRepairs, SectionsOfNoLengthLeaveTheLaneOffset) {
  // In the last 20 um, the lane is the second beside a centre line 3.5 m further to the left.
  const auto section = [](double s, const std::string& lanes) {
    return fmt::format("<laneSection s=\"{}\"><center/><right>{}</right></laneSection>", s, lanes);
  };
  const auto in_sections = [&](const std::string& offsets, const std::string& sections) {
    return repaired(ring_with("",
                              [&](RoadText* road) {
                                road->lane_offset = offsets;
                                road->sections = sections;
                              }),
                    RepairKind::short_section);
  };
  const std::string offset = R"(<laneOffset s="{}" a="{}" b="0" c="0" d="0"/>)";
  const double near_end = 40 * std::numbers::pi - 2e-5;
  const std::string beside = lane_of(-1, "none", 3.5) +
                             lane_of(-2, "driving", 3.5, R"(<link><predecessor id="-1"/><successor id="-1"/></link>)");
  const auto lane_to = [](int id, int next) {
    return lane_of(id, "driving", 3.5, fmt::format(R"(<link><predecessor id="-1"/><successor id="{}"/></link>)", next));
  };
  const RoadMap at_end =
      in_sections(fmt::format(fmt::runtime(offset), 0, 0) + fmt::format(fmt::runtime(offset), near_end, 3.5),
                  section(0, lane_to(-1, -2)) + section(near_end, beside));
  const RoadMap at_start = in_sections(
      fmt::format(fmt::runtime(offset), 0, 3.5) + fmt::format(fmt::runtime(offset), 2e-5, 0),
      section(0, beside) +
          section(2e-5, lane_of(-1, "driving", 3.5, R"(<link><predecessor id="-2"/><successor id="-1"/></link>)")));
  for (const RoadMap& map : {at_end, at_start}) {
    const Lane& lane = lane_named(map, "1", map.lanes[0].source_section, -1);
    EXPECT_EQ(num_endless(map), 2);
    EXPECT_NEAR(lane.length_m, 41.75 * std::numbers::pi, 0.02);
    test::expect_at(map, first_point(map, lane).position_m, 0, -41.75);
    test::expect_at(map, last_point(map, lane).position_m, 0, 41.75);
  }
  // An offset that continues beyond the section does so from the section's end.
  const RoadMap shifted =
      in_sections(fmt::format(fmt::runtime(offset), 0, 0) + fmt::format(fmt::runtime(offset), 50, 0.5),
                  section(0, lane_to(-1, -1)) + section(50, lane_to(-1, -1)) + section(50.0005, lane_to(-1, -1)));
  const Lane& before = lane_named(shifted, "1", 0, -1);
  const auto radius_of = [&](const LanePoint& point) {
    return std::hypot(point.position_m.x + shifted.origin_m[0], point.position_m.y + shifted.origin_m[1]);
  };
  EXPECT_NEAR(radius_of(last_point(shifted, before)), 41.75, 1e-3);
  EXPECT_NEAR(radius_of(first_point(shifted, lane_named(shifted, "1", 2, -1))), 41.25, 1e-3);
}

TEST(OpenDriveRepairs, GeometriesOfNoLengthAreLeftOut) {
  RoadText road = straight();
  road.geometry = line_at(0, 0, 0, 0, 60) + line_at(60, 60, 0, 1, 0) + line_at(60, 60, 0, 0, 40);
  const RoadMap map = repaired(road.text(), RepairKind::empty_geometry);
  EXPECT_THAT(said(map), HasSubstr("bad.xodr:8: road 1: <geometry>: attribute length: expected more than 0"));
  EXPECT_FLOAT_EQ(map.lanes[0].length_m, 100);
}

TEST(OpenDriveRepairs, TheGeometryDeterminesTheRoadLength) {
  for (const double length : {99.55, 100.45, 98.0, 101.1, 50.0, 500.0}) {
    RoadText road = straight();
    road.geometry = line_at(0, 0, 0, 0, length);
    const RoadMap map = repaired(road.text(), RepairKind::line_length);
    EXPECT_NEAR(map.lanes[0].length_m, length, 1e-3);
    EXPECT_NEAR(map.facts.driving_lane_km, 1e-3 * length, 1e-9);
    EXPECT_THAT(said(map), HasSubstr(fmt::format("bad.xodr:7: road 1: <geometry>: the reference line ends at {}; "
                                                 "expected the road's length, 100",
                                                 length)));
  }
  RoadText endless = straight();
  for (int i = 0; i < 11; ++i) endless.geometry += line_at(1e4 * i, 1e4 * i, 0, 0, 1e4);
  EXPECT_THAT(test::message_of([&] { parse_opendrive(file_of(endless.text()), "bad.xodr"); }),
              HasSubstr("ends at 110000"));
}

TEST(OpenDriveRepairs, ProfilesAreHeldBeyondTheStatedLength) {
  // The lane tapers off, and the road climbs, within the 20 m that the file gives as its length.
  RoadText road = straight(lane_with(width(0, 4, -0.1)));
  road.length = 20;
  road.geometry = line_at(0, 0, 0, 0, 100);
  road.elevation = R"(<elevation s="0" a="1" b="0.05" c="0" d="0"/>)";
  road.lane_offset = R"(<laneOffset s="0" a="0" b="0.1" c="0" d="0"/>)";
  const RoadMap map = repaired(road.text(), RepairKind::line_length);
  EXPECT_FLOAT_EQ(last_point(map, map.lanes[0]).width_m, 2);
  test::expect_at(map, last_point(map, map.lanes[0]).position_m, 100, 1, 2);
  // Records further along count.
  road.elevation += R"(<elevation s="60" a="7" b="0" c="0" d="0"/>)";
  EXPECT_NEAR(repaired(road.text(), RepairKind::line_length).facts.z_max_m, 7, 1e-6);
}

TEST(OpenDriveRepairs, SmallGapsOfShortRoadsAreBridged) {
  RoadText road = straight();
  road.length = 2;
  road.geometry = line_at(0, 0, 0, 0, 1) + line_at(1, 1, 0.3, 0, 1);
  const RoadMap map = repaired(road.text(), RepairKind::geometry_gap);
  EXPECT_THAT(said(map),
              HasSubstr("bad.xodr:8: road 1: <geometry>: begins 0.300 m from the end of the previous geometry"));
  EXPECT_NEAR(last_point(map, map.lanes[0]).position_m.y - first_point(map, map.lanes[0]).position_m.y, 0.3, 1e-4);
  road.geometry = line_at(0, 0, 0, 0, 1) + line_at(1, 1, 0.7, 0, 1);
  EXPECT_THROW(parse_opendrive(file_of(road.text()), "bad.xodr"), Error);
}

TEST(OpenDriveRepairs, JumpsAreSpreadOverTheRoad) {
  struct Case {
    double along, aside;
  };
  for (const auto& [along, aside] : std::vector<Case>{{0, 0.63}, {0, -4.9}, {3, 0}, {-3, 0}, {2, 2}}) {
    RoadText road = straight();
    road.length = 200;
    road.geometry = line_at(0, 0, 0, 0, 100) + line_at(100, 100 + along, aside, 0, 100);
    const RoadMap map = repaired(road.text(), RepairKind::geometry_jump);
    const Lane& lane = map.lanes[0];
    const Span<const LanePoint> points = map.points_of(lane);
    test::expect_at(map, points[0].position_m, 0, -1.5);
    test::expect_at(map, points[points.size() - 1].position_m, 200 + along, aside - 1.5);
    EXPECT_NEAR(map.facts.driving_lane_km, 0.2, 1e-12) << "stations stay";
    const double span = std::max(10.0, 10 * std::hypot(along, aside));
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double x = points[i].position_m.x + map.origin_m[0], y = points[i].position_m.y + map.origin_m[1];
      EXPECT_LE(std::abs(points[i].heading_rad), 0.2);
      if (std::abs(x - 100 - 0.5 * along) > 0.5 * (span + std::abs(along))) {
        EXPECT_NEAR(y, x < 100 ? -1.5 : aside - 1.5, 1e-4);
      }
      if (i == 0) continue;
      const Vec2 step = (points[i].position_m - points[i - 1].position_m).xy();
      EXPECT_GT(step.x, 0) << "never back";
      EXPECT_LE(std::abs(step.y / step.x), std::tan(0.2));
    }
  }
}

TEST(OpenDriveRepairs, JumpsNearAnEndLeaveTheEnd) {
  RoadText road = straight();
  road.geometry = line_at(0, 0, 0, 0, 2) + line_at(2, 2, 1, 0, 49) + line_at(51, 51, 0, 0, 49);
  const RoadMap map = repaired(road.text(), RepairKind::geometry_jump, 2);
  test::expect_at(map, first_point(map, map.lanes[0]).position_m, 0, -1.5);
  test::expect_at(map, last_point(map, map.lanes[0]).position_m, 100, -1.5);
}

TEST(OpenDriveRepairs, JumpsOfTheElevationAreSpreadOverTheRoad) {
  for (const double rise : {2.0, -0.6, 12.0}) {
    RoadText road = straight();
    road.elevation = fmt::format(
        R"(<elevation s="0" a="1" b="0" c="0" d="0"/><elevation s="50" a="{}" b="0.1" c="0" d="0"/>)", 1 + rise);
    const RoadMap map = repaired(road.text(), RepairKind::height_jump);
    const double half_m = std::min(50.0, std::max(5.0, 5 * std::abs(rise)));
    const Span<const LanePoint> points = map.points_of(map.lanes[0]);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double x = points[i].position_m.x + map.origin_m[0], z = points[i].position_m.z + map.origin_m[2];
      if (std::abs(x - 50) >= half_m) {
        EXPECT_NEAR(z, x < 50 ? 1 : 1 + rise + 0.1 * (x - 50), 1e-4) << x;
      }
      if (i == 0) continue;
      const Vec3 step = points[i].position_m - points[i - 1].position_m;
      EXPECT_LE(std::abs(step.z / step.x), 0.75 * std::abs(rise) / half_m + 0.1 + 1e-3) << x;
    }
  }
  RoadText road = straight();
  road.elevation = R"(<elevation s="0" a="0" b="0" c="0" d="0"/><elevation s="50" a="0.4" b="0" c="0" d="0"/>)";
  EXPECT_TRUE(parse_opendrive(file_of(road.text()), "low.xodr").mends.empty());
}

/// Some writers begin a road with a geometry of no length with another heading.
TEST(OpenDriveRepairs, VeryShortGeometriesDoNotTurnTheRoad) {
  constexpr double kNorth = 1.5707963267948966;
  for (const std::string& geometry : {line_at(0, 0, 0, 0, 1e-9) + line_at(1e-9, 1e-9, 0, kNorth, 100),
                                      line_at(0, 0, 0, kNorth, 100) + line_at(100, 0, 100, 0, 1e-9)}) {
    RoadText road = straight();
    road.geometry = geometry;
    const RoadMap map = repaired(road.text(), RepairKind::empty_geometry);
    for (const LanePoint& point : map.points_of(map.lanes[0])) EXPECT_NEAR(point.heading_rad, kNorth, 1e-6);
  }
}

TEST(OpenDriveRepairs, LargeJumpsAreRefused) {
  RoadText road = straight();
  road.geometry = line_at(0, 0, 0, 0, 50) + line_at(50, 50, 5.1, 0, 50);
  EXPECT_THAT(
      test::message_of([&] { parse_opendrive(file_of(road.text()), "bad.xodr"); }),
      HasSubstr("bad.xodr:8: road 1: <geometry>: begins 5.100 m from the end of the previous geometry, at (50, 0)"));
  std::string jumps;
  for (int i = 0; i < 1100; ++i) jumps += line_at(i, i, i % 2, 0, 1);
  road.length = 1100;
  road.geometry = jumps;
  EXPECT_THAT(test::message_of([&] { parse_opendrive(file_of(road.text()), "bad.xodr"); }),
              HasSubstr("expected at most 1000 gaps in a road"));
}

TEST(OpenDriveRepairs, GeometriesFollowEachOther) {
  RoadText road = straight();
  road.geometry = line_at(0, 0, 0, 0, 50) + line_at(50.3, 50.3, 0, 0, 49.7);
  EXPECT_FLOAT_EQ(repaired(road.text(), RepairKind::geometry_station).lanes[0].length_m, 100);
  // The previous line ends where the next begins if its length is that of the station.
  road.geometry = line_at(0, 0, 0, 0, 50) + line_at(53, 53, 0, 0, 47);
  EXPECT_FLOAT_EQ(repaired(road.text(), RepairKind::geometry_station).lanes[0].length_m, 100);
  // Lengths fit but stations do not: all later stations move. Or stations are out of order.
  const auto expect_straight = [](const RoadMap& map) {
    test::expect_at(map, first_point(map, map.lanes[0]).position_m, 0, -1.5);
    test::expect_at(map, last_point(map, map.lanes[0]).position_m, 100, -1.5);
    EXPECT_NEAR(map.facts.driving_lane_km, 0.1, 1e-12);
  };
  road.geometry = line_at(0, 0, 0, 0, 50) + line_at(70, 50, 0, 0, 20) + line_at(90, 70, 0, 0, 30);
  const RoadMap moved = repaired(road.text(), RepairKind::moved_geometry);
  expect_straight(moved);
  EXPECT_THAT(said(moved), HasSubstr("attribute s: expected 50, where the previous geometry ends, got 70"));
  road.geometry = line_at(0, 0, 0, 0, 50) + line_at(70, 50, 0, 0, 20) + line_at(110, 70, 0, 0, 30);
  const RoadMap twice = repaired(road.text(), RepairKind::moved_geometry, 2);
  EXPECT_THAT(twice.mends[1].message, HasSubstr("expected 90, where the previous geometry ends, got 110"));
  road.geometry = line_at(40, 0, 0, 0, 50) + line_at(90, 50, 0, 0, 50);
  expect_straight(repaired(road.text(), RepairKind::moved_geometry));
  road.geometry = line_at(50, 50, 0, 0, 50) + line_at(0, 0, 0, 0, 50);
  expect_straight(repaired(road.text(), RepairKind::record_order));
}

// Names of elements.

TEST(OpenDriveRepairs, LanesWithoutATypeGetADefault) {
  const RoadMap center = repaired(ring_with("",
                                            [](RoadText* road) {
                                              road->sections =
                                                  R"(<laneSection s="0"><center><lane id="0"/></center><right>)" +
                                                  road->right + "</right></laneSection>";
                                            }),
                                  RepairKind::missing_lane_type);
  EXPECT_EQ(difference(center, sound(ring_with())), "");
  EXPECT_EQ(num_endless(center), 2);
  const RoadMap side = repaired(replaced(straight().text(), "id=\"-1\" type=\"driving\"", "id=\"-1\" type=\"\""),
                                RepairKind::missing_lane_type);
  EXPECT_EQ(side.lanes.at(0).type, LaneType::other);
  EXPECT_THAT(said(side), HasSubstr("road 1: <lane>: attribute type is missing"));
}

TEST(OpenDriveRepairs, UnknownFlagsAreFalse) {
  const RoadMap map = repaired(replaced(straight().text(), "type=\"driving\"", "type=\"driving\" level=\"none\""),
                               RepairKind::unknown_flag);
  EXPECT_EQ(difference(map, sound(straight().text())), "");
  // Also looked up for the section before.
  const auto section = [](const char* attributes, const char* link) {
    return fmt::format(
        R"(<laneSection {}><center><lane id="0" type="none"/></center><right><lane id="-1" type="driving"><link>{}</link>)"
        R"(<width sOffset="0" a="3" b="0" c="0" d="0"/></lane></right></laneSection>)",
        attributes, link);
  };
  RoadText road = straight();
  road.sections =
      section("s=\"0\"", "<successor id=\"-1\"/>") + section("s=\"30\" singleSide=\"yes\"", "<predecessor id=\"-1\"/>");
  repaired(road.text(), RepairKind::unknown_flag);
}

TEST(OpenDriveRepairs, AttributesWithoutAValueAreMissing) {
  const RoadMap map =
      sound(replaced(straight().text(), "type=\"driving\"", "type=\"driving\" level=\"\" direction=\"\""));
  EXPECT_EQ(difference(map, sound(straight().text())), "");
}

TEST(OpenDriveRepairs, UnknownNamesGetADefault) {
  const RoadMap lanes =
      repaired(straight(lane_of(-1, "driving", 3) + lane_of(-2, "canal", 2)).text(), RepairKind::unknown_lane_type);
  EXPECT_EQ(lane_named(lanes, "1", 0, -2).type, LaneType::other);
  EXPECT_THAT(said(lanes), HasSubstr("road 1: <lane>: attribute type: 'canal' is not a lane type"));
  const RoadMap direction =
      repaired(replaced(straight().text(), "type=\"driving\"", "type=\"driving\" direction=\"up\""),
               RepairKind::unknown_direction);
  EXPECT_EQ(difference(direction, sound(straight().text())), "");
}

std::string with_mark(const std::string& mark) {
  RoadText road = straight();
  road.center_mark = mark;
  return road.text();
}

TEST(OpenDriveRepairs, UnknownMarksArePaintedByTheirLines) {
  EXPECT_EQ(repaired(with_mark(R"(<roadMark sOffset="0" type="wavy"/>)"), RepairKind::unknown_mark).markings.size(),
            0u);
  const RoadMap lines =
      repaired(with_mark(R"(<roadMark sOffset="0" type="wavy" color="yellow"><type name="" width="0.2">)"
                         R"(<line length="5" space="5" tOffset="0" sOffset="0" width="0.2"/></type></roadMark>)"),
               RepairKind::unknown_mark);
  EXPECT_EQ(lines.markings.size(), 10u);
  const RoadMap pink =
      repaired(with_mark(R"(<roadMark sOffset="0" type="solid" color="pink"/>)"), RepairKind::unknown_color);
  EXPECT_EQ(pink.markings.at(0).color, MarkColor::white);
  EXPECT_EQ(
      repaired(with_mark(R"(<roadMark sOffset="0" type="solid" laneChange="some"/>)"), RepairKind::unknown_lane_change)
          .markings.size(),
      1u);
}

TEST(OpenDriveRepairs, SizesBelowZeroAreTheDefault) {
  const std::string line = R"(<type name=""{}><line length="5" space="5" tOffset="0" sOffset="0"{}/></type>)";
  const auto mark = [&](const std::string& of_mark, const std::string& of_type, const std::string& of_line) {
    return with_mark("<roadMark sOffset=\"0\" type=\"solid\"" + of_mark + ">" +
                     (of_type.empty() && of_line.empty() ? "" : fmt::format(fmt::runtime(line), of_type, of_line)) +
                     "</roadMark>");
  };
  const std::string minus = R"( width="-1")", ten = R"( width="0.1")";
  EXPECT_EQ(difference(repaired(mark(minus, "", ""), RepairKind::negative_size), sound(mark("", "", ""))), "");
  EXPECT_EQ(difference(repaired(mark(minus, ten, minus), RepairKind::negative_size, 2), sound(mark(ten, ten, ten))),
            "");
}

TEST(OpenDriveRepairs, MarksBeyondTheirSectionAreLeftOut) {
  EXPECT_EQ(
      repaired(with_mark(R"(<roadMark sOffset="105" type="solid"/>)"), RepairKind::record_beyond_end).markings.size(),
      0u);
}

TEST(OpenDriveRepairs, MarksOutOfOrderAreSorted) {
  const std::string solid = R"(<roadMark sOffset="0" type="solid"/>)", none = R"(<roadMark sOffset="40" type="none"/>)";
  EXPECT_EQ(difference(repaired(with_mark(none + solid), RepairKind::record_order), sound(with_mark(solid + none))),
            "");
}

TEST(OpenDriveRepairs, DashesOfNoLengthAreContinuous) {
  const auto mark = [](const std::string& kind, const std::string& space) {
    return with_mark(
        fmt::format(R"(<roadMark sOffset="0" type="solid"><{}><line length="0" {} tOffset="0" sOffset="0" )"
                    R"(width="0.15"/></{}></roadMark>)",
                    kind, space, kind));
  };
  const RoadMap map = repaired(mark("type", "space=\"0\""), RepairKind::endless_dash);
  ASSERT_EQ(map.markings.size(), 1u);
  EXPECT_FALSE(map.markings[0].broken);
  EXPECT_EQ(repaired(mark("explicit", ""), RepairKind::empty_line).markings.size(), 1u) << "the pattern of the type";
}

TEST(OpenDriveRepairs, SpeedsThatCannotBeReadAreLeftOut) {
  for (const char* speed : {R"(max="fast")", R"(max="-3")", R"(max="50" unit="knots")", "", R"(max="1e9")"}) {
    const RoadMap map =
        repaired(straight(lane_of(-1, "driving", 3, fmt::format("<speed sOffset=\"0\" {}/>", speed))).text(),
                 RepairKind::unreadable_speed);
    EXPECT_EQ(difference(map, sound(straight().text())), "") << speed;
  }
}

// Objects and signals.

std::string with_rest(const std::string& rest) {
  RoadText road = straight();
  road.rest = rest;
  return road.text();
}

TEST(OpenDriveRepairs, InvalidObjectsAreLeftOut) {
  for (const auto& [kind, object] : std::vector<std::pair<RepairKind, std::string>>{
           {RepairKind::misplaced_item, R"(<object id="1" type="crosswalk" s="500" t="0" length="2" width="2"/>)"},
           {RepairKind::misplaced_item,
            R"(<object id="1" type="crosswalk" s="5" t="0"><outline><cornerRoad s="999" t="0"/>)"
            R"(</outline></object>)"},
           {RepairKind::shapeless_object, R"(<object id="1" type="crosswalk" s="5" t="0"/>)"},
           {RepairKind::shapeless_object, R"(<object id="1" type="parking" s="5" t="0" length="5"/>)"},
           {RepairKind::shapeless_object, R"(<object id="1" type="stopLine" s="5" t="0"/>)"}}) {
    const RoadMap map = repaired(with_rest("<objects>" + object + "</objects>"), kind);
    EXPECT_EQ(difference(map, sound(straight().text())), "") << object;
    EXPECT_THAT(said(map), HasSubstr("road 1: <")) << object;
  }
  EXPECT_EQ(repaired(with_rest(R"(<signals><signal id="1" s="-57" t="1" orientation="+"/></signals>)"),
                     RepairKind::misplaced_item)
                .signs.size(),
            0u);
}

TEST(OpenDriveRepairs, InvalidRepeatsAreDrawnOnce) {
  const auto parking = [](const std::string& contents) {
    return with_rest(R"(<objects><object id="1" type="parking" s="5" t="-5" length="5" width="2">)" + contents +
                     "</object></objects>");
  };
  EXPECT_EQ(repaired(parking(R"(<repeat s="0" length="50" distance="0"/>)"), RepairKind::continuous_object)
                .parking_spaces.size(),
            1u);
  EXPECT_EQ(
      repaired(parking(R"(<repeat s="0" length="50" distance="5"/><outline><cornerRoad s="1" t="-4"/></outline>)"),
               RepairKind::repeated_corners)
          .parking_spaces.size(),
      1u);
}

TEST(OpenDriveRepairs, SignalsWithARepeatedIdAreKept) {
  const RoadMap map = repaired(
      with_rest(
          R"(<signals><signal id="5" s="10" t="-4" orientation="+"/><signal id="5" s="20" t="-4" orientation="+"/>)"
          R"(</signals>)"),
      RepairKind::repeated_signal);
  EXPECT_EQ(map.signs.size(), 2u);
  EXPECT_THAT(said(map), HasSubstr("road 1: <signal>: attribute id: another signal already has 5"));
  EXPECT_EQ(repaired(with_rest(R"(<signals><signal id="5" s="10" t="-4" orientation="left"/></signals>)"),
                     RepairKind::unknown_orientation)
                .signs.size(),
            1u);
}

TEST(OpenDriveRepairs, ReferencesToAbsentElementsAreLeftOut) {
  const std::string road = straight().text();
  const std::string control = R"(<controller id="4"><control signalId="6"/></controller>)";
  EXPECT_EQ(
      difference(repaired(with_rest(R"(<signals><signalReference id="77" s="0" t="0" orientation="+"/></signals>)"),
                          RepairKind::missing_signal),
                 sound(road)),
      "");
  EXPECT_THAT(said(repaired(road + control, RepairKind::missing_signal)),
              HasSubstr("controller 4: <controller>: controls signal 6, which does not exist"));
  repaired(road + R"(<junction id="3"><controller id="9"/></junction>)", RepairKind::missing_controller);
  repaired(road + R"(<controller id="4"/><controller id="4"/>)", RepairKind::repeated_controller);
  const RoadMap lost = repaired(replaced(road, "junction=\"-1\"", "junction=\"5\""), RepairKind::missing_junction);
  EXPECT_EQ(difference(lost, sound(road)), "");
}

// Links.

std::string link_to(const char* end, const std::string& road, const std::string& contact) {
  return fmt::format(R"(<{} elementType="road" elementId="{}"{}/>)", end, road,
                     contact.empty() ? "" : fmt::format(" contactPoint=\"{}\"", contact));
}

/// Roads 1 and 2, which meet at x = 100, with the given links.
std::string two_roads(const std::string& link_1, const std::string& link_2, const std::string& lane_link = "-1") {
  RoadText a = straight(lane_of(-1, "driving", 3, "<link><successor id=\"" + lane_link + "\"/></link>")),
           b = straight();
  a.link = link_1;
  b.id = "2";
  b.geometry = line_at(0, 100, 0, 0, 100);
  b.link = link_2;
  return a.text() + b.text();
}

int num_links(const RoadMap& map) { return static_cast<int>(map.lane_links.size()) / 2; }

TEST(OpenDriveRepairs, LinksToAbsentElementsAreLeftOut) {
  const std::string to_2 = link_to("successor", "2", "start"), to_1 = link_to("predecessor", "1", "end");
  EXPECT_EQ(num_links(sound(two_roads(to_2, to_1))), 1);
  EXPECT_THAT(said(repaired(two_roads(link_to("successor", "9", "start"), ""), RepairKind::missing_road)),
              HasSubstr("bad.xodr:5: road 1: <successor>: refers to road 9, which does not exist"));
  EXPECT_THAT(said(repaired(two_roads(R"(<successor elementType="junction" elementId="9"/>)", ""),
                            RepairKind::missing_junction)),
              HasSubstr("road 1: <successor>: refers to junction 9, which does not exist"));
  const RoadMap lane = repaired(two_roads(to_2, to_1, "-7"), RepairKind::missing_lane);
  EXPECT_THAT(said(lane), HasSubstr("road 1: <lane>: is linked to lane -7 of road 2, which does not exist there"));
  EXPECT_EQ(num_links(lane), 0);
  EXPECT_EQ(
      num_links(repaired(two_roads(R"(<successor elementType="road" elementId="2" elementS="5" elementDir="+"/>)", ""),
                         RepairKind::link_into_road)),
      0);
}

TEST(OpenDriveRepairs, LinksThatTrafficCannotFollowAreLeftOut) {
  const std::string to_2 = link_to("successor", "2", "start"), to_1 = link_to("predecessor", "1", "end");
  const std::string sound_text = two_roads(to_2, to_1);
  const RoadMap dangling = repaired(two_roads("", ""), RepairKind::dangling_link);
  EXPECT_EQ(num_links(dangling), 0);
  EXPECT_THAT(said(dangling), HasSubstr("road 1: <lane>: is linked to lane -1 beyond the end of its road, which is "
                                        "linked to nothing there"));
  const std::string second = "<lane id=\"-1\" type=\"";
  const auto with_second = [&](const std::string& type) {
    std::string text = sound_text;
    const std::size_t at = text.rfind(second) + second.size();
    return text.replace(at, std::string("driving").size(), type);
  };
  EXPECT_THAT(said(repaired(with_second("shoulder"), RepairKind::unlike_link)),
              HasSubstr("links lane -1 of road 1 with lane -1 of road 2, which are driving and shoulder"));
  EXPECT_THAT(said(repaired(with_second("driving\" direction=\"reversed"), RepairKind::opposed_link)),
              HasSubstr("whose traffic meets head on there"));
  EXPECT_THAT(
      said(repaired(replaced(sound_text, "x=\"100\" y=\"0\"", "x=\"100\" y=\"1.5\""), RepairKind::distant_link)),
      HasSubstr("which are 1.50 m apart there"));
}

TEST(OpenDriveRepairs, OneSidedLinksBecomeMutual) {
  const std::string to_2 = link_to("successor", "2", "start");
  const RoadMap map = repaired(two_roads(to_2, ""), RepairKind::one_sided_link);
  EXPECT_THAT(said(map),
              HasSubstr("road 1: <successor>: the start of road 2 is not linked back to the end of this road"));
  EXPECT_EQ(difference(map, sound(two_roads(to_2, link_to("predecessor", "1", "end")))), "");
}

TEST(OpenDriveRepairs, GeometryDeterminesTheEndOfALink) {
  const std::string to_2 = link_to("successor", "2", "start"), to_1 = link_to("predecessor", "1", "end");
  const RoadMap map = repaired(two_roads(link_to("successor", "2", "end"), to_1), RepairKind::wrong_end);
  EXPECT_THAT(said(map),
              HasSubstr("road 1: <successor>: attribute contactPoint: expected start, which touches the end of "
                        "this road, got end"));
  EXPECT_EQ(difference(map, sound(two_roads(to_2, to_1))), "");
  EXPECT_EQ(difference(repaired(two_roads(link_to("successor", "2", ""), to_1), RepairKind::missing_contact),
                       sound(two_roads(to_2, to_1))),
            "");
  EXPECT_EQ(num_links(repaired(two_roads(link_to("successor", "2", "middle"), to_1), RepairKind::missing_contact)), 1);
}

TEST(OpenDriveRepairs, InconsistentLinksAreKeptWhereTheEndsTouch) {
  RoadText third = straight();
  third.id = "3";
  third.geometry = line_at(0, 0, 50, 0, 100);
  third.link = link_to("successor", "2", "start");
  third.right = lane_of(-1, "driving", 3, R"(<link><successor id="-1"/></link>)");
  const std::string to_2 = link_to("successor", "2", "start"), to_1 = link_to("predecessor", "1", "end");
  const RoadMap apart = repaired(two_roads(to_2, to_1) + third.text(), RepairKind::contrary_link);
  EXPECT_EQ(num_links(apart), 1);
  EXPECT_THAT(said(apart),
              HasSubstr("road 3: <successor>: the start of road 2 is linked to the end of road 1 instead of "
                        "the end of this road"));
  third.geometry = line_at(0, 0, 0, 0, 100);
  EXPECT_EQ(num_links(repaired(two_roads(to_2, to_1) + third.text(), RepairKind::unreturned_link)), 2);
  RoadText ring = straight();
  ring.link = link_to("predecessor", "1", "start");
  repaired(ring.text(), RepairKind::contrary_link);
}

TEST(OpenDriveRepairs, ConnectionsFindTheirEnds) {
  const std::string good = test::three_roads();
  ASSERT_EQ(num_links(sound(good)), 4);
  // The connecting road begins at the incoming road; the file refers to its end.
  const RoadMap wrong = repaired(
      replaced(good, "connectingRoad=\"2\" contactPoint=\"start\"", "connectingRoad=\"2\" contactPoint=\"end\""),
      RepairKind::wrong_end);
  EXPECT_EQ(difference(wrong, sound(good)), "");
  EXPECT_THAT(said(wrong), HasSubstr("junction 7: <connection>: attribute contactPoint"));
  EXPECT_EQ(difference(repaired(replaced(good, "connectingRoad=\"2\" contactPoint=\"start\"", "connectingRoad=\"2\""),
                                RepairKind::missing_contact),
                       sound(good)),
            "");
  const std::string more = R"(<connection id="1" incomingRoad="{}" connectingRoad="{}" contactPoint="start"/>)";
  for (const auto& [incoming, connecting, kind] : std::vector<std::tuple<const char*, const char*, RepairKind>>{
           {"1", "8", RepairKind::missing_road}, {"8", "2", RepairKind::missing_road}}) {
    EXPECT_EQ(num_links(repaired(test::three_roads("", fmt::format(fmt::runtime(more), incoming, connecting)), kind)),
              4);
  }
  // A road that neither leads to the junction nor touches it.
  RoadText far = straight();
  far.id = "5";
  far.geometry = line_at(0, 0, 500, 0, 100);
  EXPECT_EQ(num_links(repaired(far.text() + test::three_roads("", fmt::format(fmt::runtime(more), "5", "2")),
                               RepairKind::unconnected_road)),
            4);
  // A road that touches the junction without a link.
  far.geometry = line_at(0, 0, 0, 0, 100);
  repaired(far.text() + test::three_roads("", fmt::format(fmt::runtime(more), "5", "2")), RepairKind::one_sided_link);
}

TEST(OpenDriveRepairs, JunctionsOfOtherKindsConnectNothing) {
  RoadText road = straight();
  road.link = R"(<successor elementType="junction" elementId="3"/>)";
  const RoadMap map = repaired(road.text() + R"(<junction id="3" type="virtual" mainRoad="2" sStart="1" sEnd="2"/>)",
                               RepairKind::unsupported_junction);
  EXPECT_THAT(said(map), HasSubstr("junction 3: <junction>: attribute type: 'virtual' junctions are not supported"));
  EXPECT_EQ(map.junctions.size(), 1u);
}

TEST(OpenDriveRepairs, MarksThatRunBackAreCut) {
  // A right bend of 5 m radius, with a mark 8 m to its inner side.
  RoadText road;
  road.length = 15;
  road.geometry =
      R"(<geometry s="0" x="0" y="0" hdg="0" length="5"><line/></geometry>)"
      R"(<geometry s="5" x="5" y="0" hdg="0" length="5"><arc curvature="-0.2"/></geometry>)"
      R"(<geometry s="10" x="9.2073549240394827" y="-2.2984884706593015" hdg="-1" length="5"><line/></geometry>)";
  road.right =
      lane_of(-1, "driving", 3) + lane_of(-2, "driving", 5, R"(<roadMark sOffset="0" type="solid" width="0.1"/>)");
  const RoadMap map = repaired(road.text(), RepairKind::self_crossing_mark);
  EXPECT_THAT(said(map), HasSubstr("road 1: <roadMark>:"));
  ASSERT_EQ(map.markings.size(), 2u) << "before and after";
  // Sections that end where the limit changes have copies of the mark, but its fault is counted once.
  road.type = R"(<type s="0" type="town"><speed max="10"/></type><type s="7" type="town"><speed max="20"/></type>)";
  EXPECT_EQ(repaired(road.text(), RepairKind::self_crossing_mark).lanes.size(), 4u);
}

// Messages about repairs.

TEST(OpenDriveRepairs, RepairsAreGroupedWithTheMostFrequentFirst) {
  RoadText road = straight();
  for (int i = 0; i < 3; ++i) road.center_mark += R"(<roadMark sOffset="0" type="solid" color="pink"/>)";
  road.type = R"(<type s="125" type="town"/>)";
  const RoadMap map = parse_opendrive(file_of(road.text()), "bad.xodr");
  EXPECT_THAT(
      describe_repairs(map.mends, "bad.xodr"),
      ElementsAre(AllOf(StartsWith("3 x unknown colors of road marks: painted white; first: bad.xodr:"),
                        HasSubstr("road 1: <roadMark>: attribute color: 'pink'")),
                  StartsWith("1 x records beyond the end of their section or road: left out; first: bad.xodr:")));
  EXPECT_EQ(map.mends.size(), 4u);
}

TEST(OpenDriveRepairs, TooManyFaultsAreRefused) {
  std::string marks;
  for (int i = 0; i < 1'000'001; ++i) marks += "<roadMark type='x'/>";
  RoadText road = straight();
  road.center_mark = marks;
  EXPECT_THAT(test::message_of([&] { parse_opendrive(file_of(road.text()), "bad.xodr"); }),
              HasSubstr("after 1000000 other faults"));
}

TEST(OpenDriveRepairs, AmbiguousFaultsAreRefused) {
  EXPECT_THROW(parse_opendrive("", "bad.xodr"), Error);
  EXPECT_THROW(parse_opendrive("<OpenDRIVE/>", "bad.xodr"), Error);
  for (const auto& [from, to] :
       std::vector<std::pair<std::string, std::string>>{{"x=\"0\"", "x=\"inf\""},
                                                        {"x=\"0\"", ""},
                                                        {"<line/>", ""},
                                                        {"<line/>", "<arc/>"},
                                                        {"a=\"3\"", "a=\"x\""},
                                                        {"a=\"3\"", "a=\"2000\""},
                                                        {"id=\"-1\" type", "id=\"1\" type"},
                                                        {"road id=\"1\"", "road"},
                                                        {"junction=\"-1\"", "junction=\"-1\" rule=\"XHT\""}}) {
    const std::string file = file_of(replaced(straight().text(), from, to));
    EXPECT_THAT(test::message_of([&] { parse_opendrive(file, "bad.xodr"); }), StartsWith("bad.xodr:"))
        << from << " -> " << to;
  }
  EXPECT_THAT(test::message_of([&] { parse_opendrive(file_of(straight().text() + straight().text()), "bad.xodr"); }),
              HasSubstr("road 1: <road>: attribute id: another road already has it"));
}

TEST(OpenDriveRepairs, DamagedFilesGiveAValidMapOrAnError) {
  // parse_opendrive validates its result; anything other than a map or an Error ends the test.
  const std::string valid_text = file_of(test::three_roads());
  std::mt19937 random(7);
  const std::string alphabet = "0123456789-.e\"<>/= abcxyz";
  int maps = 0, repaired_maps = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    std::string text = valid_text;
    for (unsigned damage = random() % 3 + 1; damage-- > 0;) {
      const std::size_t at = random() % text.size();
      if (random() % 4 == 0) {
        text.erase(at, random() % 12);
      } else {
        text[at] = alphabet[random() % alphabet.size()];
      }
    }
    try {
      const RoadMap map = parse_opendrive(text, "damaged.xodr");
      ++maps;
      repaired_maps += map.mends.empty() ? 0 : 1;
    } catch (const Error&) {
    }
  }
  EXPECT_GT(maps, 150);
  EXPECT_GT(repaired_maps, 60);
}

TEST(OpenDriveRepairs, TheTableListsEveryKind) {
  const std::string docs = read_file(PICTURA_OPENDRIVE_DOCS);
  for (const RepairKind kind : repair_kinds()) {
    if (kind >= kFirstLanelet2Repair) continue;
    EXPECT_THAT(docs, HasSubstr(fmt::format("| {} | {} |", to_string(kind), action_of(kind))));
  }
}

}  // namespace
}  // namespace pictura
