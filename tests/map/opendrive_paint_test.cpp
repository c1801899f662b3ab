// Paint: road marks of every type, explicit lines, crosswalks, stop lines and parking spaces.
#include <cmath>
#include <string>
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
using test::lane_of;
using test::line_at;
using test::parse;
using test::RoadText;

/// The map of a straight road of 100 m with these marks on its centre lane.
RoadMap marked(const std::string& marks) {
  RoadText road;
  road.center_mark = marks;
  road.right = lane_of(-1, "driving", 3);
  return parse(road.text());
}

/// Start and end of a marking along the road, and its lateral offset to the left at the start.
struct Stroke {
  double begin, end, left;
  bool operator==(const Stroke&) const = default;
};

std::vector<Stroke> strokes_of(const RoadMap& map) {
  std::vector<Stroke> strokes;
  auto rounded = [](double value) { return std::round(value * 1000) / 1000 + 0.0; };
  for (const Marking& marking : map.markings) {
    const Vec3 a = map.marking_points[marking.points.begin];
    const Vec3 b = map.marking_points[static_cast<std::size_t>(marking.points.end) - 1];
    strokes.push_back({rounded(a.x + map.origin_m[0]), rounded(b.x + map.origin_m[0]), rounded(a.y + map.origin_m[1])});
  }
  return strokes;
}

TEST(OpenDrivePaint, MarksHaveTheirPatternsColoursAndWidths) {
  auto marks = [](const std::string& attributes) {
    RoadText road;
    road.center_mark = "<roadMark sOffset=\"0\" " + attributes + "/>";
    road.right = lane_of(-1, "driving", 3);
    return parse(road.text());
  };
  const RoadMap solid = marks(R"(type="solid" color="yellow" width="0.2")");
  ASSERT_EQ(solid.markings.size(), 1u);
  EXPECT_EQ(solid.markings[0].color, MarkColor::yellow);
  EXPECT_FLOAT_EQ(solid.markings[0].width_m, 0.2f);
  EXPECT_FALSE(solid.markings[0].broken);

  // Dashes of 3 m every 12 m begin at 0, 12, ..., 96.
  const RoadMap broken = marks(R"(type="broken" color="white")");
  ASSERT_EQ(broken.markings.size(), 9u);
  for (std::size_t i = 0; i < 9; ++i) {
    const Vec3 a = broken.marking_points[broken.markings[i].points.begin];
    const Vec3 b = broken.marking_points[static_cast<std::size_t>(broken.markings[i].points.end) - 1];
    expect_at(broken, a, 12.0 * static_cast<double>(i), 0);
    expect_at(broken, b, 12.0 * static_cast<double>(i) + 3, 0);
    EXPECT_TRUE(broken.markings[i].broken);
  }

  // The first word of a centre line's type is its left stripe, one width from the centre.
  const RoadMap both = marks(R"(type="solid broken" color="white" width="0.1")");
  ASSERT_EQ(both.markings.size(), 10u);
  for (const Marking& marking : both.markings) {
    expect_at(both, both.marking_points[marking.points.begin],
              both.marking_points[marking.points.begin].x + both.origin_m[0], marking.broken ? -0.1 : 0.1);
  }
  EXPECT_EQ(marks(R"(type="solid solid" color="white")").markings.size(), 2u);
  EXPECT_EQ(marks(R"(type="none" color="white")").markings.size(), 0u);
  for (const char* unpainted : {"curb", "edge", "grass"}) {
    EXPECT_EQ(marks(fmt::format(R"(type="{}" color="white")", unpainted)).markings.size(), 0u) << unpainted;
  }
}

TEST(OpenDrivePaint, CrosswalksAndParkingSpacesAreAtTheirPlaces) {
  RoadText road;
  road.geometry = line_at(0, 0, 0, M_PI / 2, 100);
  road.right = lane_of(-1, "driving", 3);
  road.rest =
      R"(<objects><object id="1" type="crosswalk" s="10" t="2" zOffset="0.5" hdg="0"><outline>)"
      R"(<cornerLocal u="1" v="1" z="0"/><cornerLocal u="-1" v="1" z="0"/><cornerLocal u="-1" v="-1" z="0"/>)"
      R"(<cornerLocal u="1" v="1" z="0"/></outline></object>)"
      R"(<object id="2" type="crosswalk" s="0" t="0"><outline><cornerRoad s="20" t="3" dz="0"/>)"
      R"(<cornerRoad s="22" t="3" dz="0"/><cornerRoad s="22" t="-3" dz="1"/></outline></object>)"
      R"(<object id="3" type="parking" s="30" t="-4" hdg="1.5707963267948966" length="2" width="5"/></objects>)";
  const RoadMap map = parse(road.text());
  ASSERT_EQ(map.crosswalks.size(), 2u);
  ASSERT_EQ(map.crosswalks[0].outline.size(), 3);
  // The road runs along +y, so its left is -x.
  expect_at(map, map.outline_points[0], -3, 11, 0.5);
  expect_at(map, map.outline_points[1], -3, 9, 0.5);
  expect_at(map, map.outline_points[2], -1, 9, 0.5);
  expect_at(map, map.outline_points[3], -3, 20);
  expect_at(map, map.outline_points[5], 3, 22, 1);
  ASSERT_EQ(map.parking_spaces.size(), 1u);
  expect_at(map, map.parking_spaces[0].center_m, 4, 30);
  EXPECT_FLOAT_EQ(map.parking_spaces[0].length_m, 5);
  EXPECT_FLOAT_EQ(map.parking_spaces[0].width_m, 2);
  EXPECT_NEAR(map.parking_spaces[0].heading_rad, M_PI / 2, 1e-5);
}

TEST(OpenDrivePaint, ColoursAndWeightsOfAllVersions) {
  const std::vector<std::pair<const char*, MarkColor>> colors = {
      {"standard", MarkColor::white}, {"white", MarkColor::white},   {"yellow", MarkColor::yellow},
      {"red", MarkColor::red},        {"green", MarkColor::green},   {"blue", MarkColor::blue},
      {"orange", MarkColor::orange},  {"violet", MarkColor::violet}, {"black", MarkColor::black}};
  for (const auto& [name, color] : colors) {
    const RoadMap map = marked(fmt::format(R"(<roadMark sOffset="0" type="solid" color="{}"/>)", name));
    ASSERT_EQ(map.markings.size(), 1u);
    EXPECT_EQ(map.markings[0].color, color) << name;
    EXPECT_FLOAT_EQ(map.markings[0].width_m, 0.125f);
  }
  const RoadMap bold = marked(R"(<roadMark sOffset="0" type="solid" weight="bold" color="white"/>)");
  EXPECT_FLOAT_EQ(bold.markings[0].width_m, 0.25f);
  EXPECT_EQ(marked(R"(<roadMark sOffset="0" type="solid" color="mauve"/>)").mends.size(), 1u);
  EXPECT_EQ(marked(R"(<roadMark sOffset="0" type="dotted" color="white"/>)").mends.size(), 1u);
}

TEST(OpenDrivePaint, BottsDotsAreSpaced) {
  const RoadMap map = marked(R"(<roadMark sOffset="0" type="botts dots" color="white"/>)");
  const std::vector<Stroke> strokes = strokes_of(map);
  ASSERT_EQ(strokes.size(), 82u);  // one every 1.2192 m; the remaining 3 cm of the last are too short
  EXPECT_NEAR(strokes[1].begin, 1.219, 1e-3);
  EXPECT_NEAR(strokes[1].end - strokes[1].begin, 0.1016, 2e-3);
}

TEST(OpenDrivePaint, ListedLinesReplaceTheTypesPattern) {
  // Dashes of 6 m and gaps of 9 m, from 2 m after the start of the mark at 40, 0.3 m to the left; a yellow line on the
  // right.
  const RoadMap map =
      marked(R"(<roadMark sOffset="40" type="broken solid" color="white" width="0.12"><type name="" width="0.12">)"
             R"(<line length="6" space="9" tOffset="0.3" sOffset="2" width="0.2" rule="caution"/>)"
             R"(<line length="1" space="0" tOffset="-0.3" sOffset="0" color="yellow"/></type></roadMark>)");
  EXPECT_EQ(strokes_of(map),
            (std::vector<Stroke>{{42, 48, 0.3}, {57, 63, 0.3}, {72, 78, 0.3}, {87, 93, 0.3}, {40, 100, -0.3}}));
  EXPECT_FLOAT_EQ(map.markings[0].width_m, 0.2f);
  EXPECT_EQ(map.markings[0].color, MarkColor::white);
  EXPECT_TRUE(map.markings[0].broken);
  EXPECT_FLOAT_EQ(map.markings[4].width_m, 0.12f);
  EXPECT_EQ(map.markings[4].color, MarkColor::yellow);
  EXPECT_FALSE(map.markings[4].broken);
}

TEST(OpenDrivePaint, ExplicitLinesArePaintedOnceAndSwayMovesThem) {
  const RoadMap map =
      marked(R"(<roadMark sOffset="10" type="custom" color="white"><sway ds="0" a="1" b="0" c="0" d="0"/>)"
             R"(<explicit><line length="4" sOffset="5" tOffset="0"/><line length="2" sOffset="20" tOffset="-0.5"/>)"
             R"(</explicit></roadMark>)");
  EXPECT_EQ(strokes_of(map), (std::vector<Stroke>{{15, 19, 1}, {30, 32, 0.5}}));
}

TEST(OpenDrivePaint, StopLinesAreReadFromTheirCornersAndBoxes) {
  RoadText road;
  road.right = lane_of(-1, "driving", 3);
  road.rest =
      R"(<objects><object id="1" name="StopLine" type="-1" s="10" t="-1.5" hdg="1.5707963267948966" length="3" width="0">)"
      R"(<outline><cornerLocal u="-1.5" v="0" z="0"/><cornerLocal u="1.5" v="0" z="0"/></outline></object>)"
      R"(<object id="2" type="roadMark" subtype="signalLines" s="90" t="-1.5" hdg="0" length="0.5" width="3"/>)"
      R"(<object id="3" type="pole" name="StopSignPost" s="50" t="-5"/></objects>)";
  const RoadMap map = parse(road.text());
  ASSERT_EQ(map.stop_lines.size(), 2u);
  EXPECT_EQ(map.facts.painted_stop_lines, 2);
  expect_at(map, map.stop_lines[0].a_m, 10, -3);
  expect_at(map, map.stop_lines[0].b_m, 10, 0);
  EXPECT_FLOAT_EQ(map.stop_lines[0].width_m, 0.4f);
  EXPECT_NEAR(map.stop_lines[1].a_m.x + map.origin_m[0], 90, 1e-4);
  EXPECT_NEAR(map.stop_lines[1].b_m.x + map.origin_m[0], 90, 1e-4);
  EXPECT_NEAR(std::abs(map.stop_lines[1].a_m.y - map.stop_lines[1].b_m.y), 3, 1e-4);
  EXPECT_FLOAT_EQ(map.stop_lines[1].width_m, 0.5f);
}

TEST(OpenDrivePaint, RepeatedParkingSpacesAreInARow) {
  RoadText road;
  road.right = lane_of(-1, "driving", 3);
  const std::string object = R"(<objects><object id="1" type="parkingSpace" s="5" t="-5" length="5" width="2">)"
                             R"(<repeat s="20" length="12" distance="{}" tStart="-5" tEnd="-7" zOffsetStart="0"/>)"
                             R"(</object></objects>)";
  road.rest = fmt::format(fmt::runtime(object), 6);
  const RoadMap map = parse(road.text());
  ASSERT_EQ(map.parking_spaces.size(), 3u);
  for (int i = 0; i < 3; ++i) {
    expect_at(map, map.parking_spaces[i].center_m, 20 + 6 * i, -5 - i);
  }
  road.rest = fmt::format(fmt::runtime(object), 0);
  EXPECT_EQ(parse(road.text()).mends.at(0).kind, RepairKind::continuous_object);
}

}  // namespace
}  // namespace pictura
