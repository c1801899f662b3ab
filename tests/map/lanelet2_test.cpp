// Lanelet2 maps: small maps whose lanes, edges, paint, lights and limits are known, and invalid maps.
#include "pictura/map/lanelet2/lanelet2.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/map/load_map.h"
#include "pictura/map/map_fields.h"
#include "pictura/map/open_lanes.h"
#include "pictura/map/repairs.h"
#include "pictura/tests/map/lanelet2_text.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/scratch_folder.h"

namespace pictura {
namespace {

using test::EnvironmentVariable;
using test::OsmText;
using test::ScratchFolder;
using test::TagList;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

template <typename Work>
std::string error_message(Work&& work) {
  return test::message_of(std::forward<Work>(work));
}

RoadMap import(const OsmText& text) { return parse_lanelet2(text.text(), "road.osm"); }

/// Imports a map without faults.
RoadMap sound(const OsmText& text) {
  RoadMap map = import(text);
  EXPECT_EQ(describe_repairs(map.mends, "road.osm"), std::vector<std::string>{});
  return map;
}

/// Imports a map with faults of one kind; strict reading must refuse it with the message of one.
RoadMap repaired(const OsmText& text, RepairKind kind, std::size_t count = 1) {
  RoadMap map = import(text);
  std::vector<std::string> messages;
  for (const Repair& repair : map.mends) {
    EXPECT_STREQ(to_string(repair.kind), to_string(kind)) << repair.message;
    messages.push_back(message_of(repair, "road.osm"));
  }
  EXPECT_EQ(map.mends.size(), count) << to_string(kind);
  const std::string refusal = error_message([&] { parse_lanelet2(text.text(), "road.osm", {.strict = true}); });
  EXPECT_THAT(messages, ::testing::Contains(refusal));
  return map;
}

const Lane& lane_named(const RoadMap& map, const std::string& name, int direction = 1) {
  for (const Lane& lane : map.lanes) {
    if (map.road_names[lane.source_road] == name && lane.source_lane == direction) return lane;
  }
  throw Error("no lane " + name);
}
int32_t index_of(const RoadMap& map, const Lane& lane) { return static_cast<int32_t>(&lane - map.lanes.data()); }
std::vector<std::string> names_of(const RoadMap& map, Span<const int32_t> lanes) {
  std::vector<std::string> names;
  for (const int32_t lane : lanes) names.push_back(map.road_names[map.lanes[lane].source_road]);
  return names;
}
std::string left_of(const RoadMap& map, const std::string& name) {
  const int32_t left = lane_named(map, name).left_neighbor;
  return left < 0 ? "" : map.road_names[map.lanes[left].source_road];
}
Vec3 in_file(const RoadMap& map, Vec3 p) {
  return {p.x + static_cast<float>(map.origin_m[0]), p.y + static_cast<float>(map.origin_m[1]),
          p.z + static_cast<float>(map.origin_m[2])};
}
double edge_length_m(const RoadMap& map) {
  double sum = 0;
  for (const RoadEdge& edge : map.road_edges) sum += static_cast<double>(length(edge.b_m - edge.a_m));
  return sum;
}

/// A lane of 100 m along x, 3.5 m wide, with its right border on the x axis: ways 11 (left) and 12 (right).
OsmText street(const TagList& tags = {}, const TagList& left_tags = {}) {
  OsmText text;
  text.node(1, 0, 3.5, 7).node(2, 100, 3.5, 9).node(3, 0, 0, 7).node(4, 100, 0, 9);
  text.way(11, {1, 2}, left_tags).way(12, {3, 4}, {{"type", "curbstone"}, {"subtype", "high"}});
  return text.lanelet(20, 11, 12, tags);
}

TEST(Lanelet2, AOneWayStreetHasItsLengthWidthHeightsAndOpenEnds) {
  const RoadMap map = sound(street());
  ASSERT_EQ(map.lanes.size(), 1u);
  EXPECT_EQ(map.origin_m, (std::array<double, 3>{50, 2, 8}));
  const Lane& lane = map.lanes[0];
  EXPECT_EQ(lane.type, LaneType::driving);
  EXPECT_FLOAT_EQ(lane.length_m, 100);
  EXPECT_FLOAT_EQ(lane.speed_limit_mps, 50 / 3.6f);
  const Span<const LanePoint> points = map.points_of(lane);
  for (const LanePoint& point : points) {
    EXPECT_FLOAT_EQ(point.width_m, 3.5f);
    EXPECT_NEAR(point.heading_rad, 0, 1e-6);
    const Vec3 p = in_file(map, point.position_m);
    EXPECT_NEAR(p.x, point.s_m, 1e-4);
    EXPECT_NEAR(p.y, 1.75, 1e-6);
    EXPECT_NEAR(p.z, 7 + 0.02 * static_cast<double>(point.s_m), 1e-5);
  }
  EXPECT_EQ(points.size(), 11u);  // pieces of 10 m
  // Both sides, and nothing across the ends, where traffic enters and leaves; the road is on the right of each edge.
  EXPECT_NEAR(edge_length_m(map), 2 * std::hypot(100, 2), 0.01);
  for (const RoadEdge& edge : map.road_edges) {
    const Vec3 a = in_file(map, edge.a_m), b = in_file(map, edge.b_m);
    EXPECT_NEAR(a.y, b.y, 1e-4);
    EXPECT_EQ(b.x > a.x, a.y > 1);
  }
  EXPECT_EQ(count_lane_use(map).open, 1);
  EXPECT_EQ(map.facts.lanes, 1);
  EXPECT_NEAR(map.facts.driving_lane_km, 0.1, 1e-6);
  EXPECT_EQ(map.facts.z_min_m, 7);
  EXPECT_EQ(map.facts.z_max_m, 9);
  EXPECT_EQ(map.provenance.lanes[0].line, 9);
  EXPECT_EQ(map.road_names, std::vector<std::string>{"20"});
}

TEST(Lanelet2, BordersOfAnyDirectionAreAligned) {
  const RoadMap expected = sound(street());
  for (const auto& [left, right] : {std::pair{"2,1", "3,4"}, {"1,2", "4,3"}, {"2,1", "4,3"}}) {
    OsmText text;
    text.node(1, 0, 3.5, 7).node(2, 100, 3.5, 9).node(3, 0, 0, 7).node(4, 100, 0, 9);
    const auto nodes = [](const std::string& ids) { return std::vector<int>{ids[0] - '0', ids[2] - '0'}; };
    text.way(11, nodes(left)).way(12, nodes(right), {{"type", "curbstone"}, {"subtype", "high"}}).lanelet(20, 11, 12);
    EXPECT_EQ(first_difference(sound(text), expected), "") << left << " " << right;
  }
}

TEST(Lanelet2, BordersWithDifferentPointsGiveTheMiddleOfTheSurface) {
  // A quarter circle about (0, 0) between radii of 8 and 12 m, the outer border with more points.
  OsmText text;
  std::vector<int> inner, outer;
  for (int i = 0; i <= 30; ++i) {
    const double a = i * kPi / 60;
    text.node(100 + i, 12 * std::cos(a), 12 * std::sin(a));
    outer.push_back(100 + i);
  }
  for (int i = 0; i <= 20; ++i) {
    const double a = i * kPi / 40;
    text.node(200 + i, 8 * std::cos(a), 8 * std::sin(a));
    inner.push_back(200 + i);
  }
  const RoadMap map = sound(text.way(1, inner).way(2, outer).lanelet(3, 1, 2));
  EXPECT_NEAR(map.lanes[0].length_m, 5 * kPi, 0.02);
  for (const LanePoint& point : map.points_of(map.lanes[0])) {
    EXPECT_NEAR(length(in_file(map, point.position_m).xy()), 10, 0.03);
    EXPECT_NEAR(point.width_m, 4, 0.03);
  }
}

TEST(Lanelet2, AStatedCenterLineIsUsed) {
  OsmText text;
  text.node(1, 0, 4).node(2, 100, 4).node(3, 0, 0).node(4, 100, 0).node(5, 100, 1).node(6, 0, 1);
  text.way(11, {1, 2}).way(12, {3, 4}).way(13, {5, 6});
  text.relation(20, {{"way", "left", 11}, {"way", "right", 12}, {"way", "centerline", 13}},
                {{"type", "lanelet"}, {"subtype", "road"}});
  const RoadMap map = sound(text);
  for (const LanePoint& point : map.points_of(map.lanes[0])) {
    EXPECT_NEAR(in_file(map, point.position_m).y, 1, 1e-5);
    EXPECT_NEAR(point.heading_rad, 0, 1e-6);
    EXPECT_FLOAT_EQ(point.width_m, 4);
  }
}

/// Three lanes side by side along x: 20 on the left, 21, 22; the lines between them have the given tags.
OsmText three_lanes(const TagList& left_line, const TagList& right_line) {
  OsmText text;
  for (int i = 0; i < 4; ++i) text.node(10 + i, 0, 9 - 3 * i).node(20 + i, 60, 9 - 3 * i);
  text.way(1, {10, 20}).way(2, {11, 21}, left_line).way(3, {12, 22}, right_line).way(4, {13, 23});
  return text.lanelet(20, 1, 2).lanelet(21, 2, 3).lanelet(22, 3, 4);
}

TEST(Lanelet2, LineTypesDetermineLaneChanges) {
  const TagList dashed{{"type", "line_thin"}, {"subtype", "dashed"}},
      solid{{"type", "line_thin"}, {"subtype", "solid"}};
  const RoadMap map = sound(three_lanes(dashed, solid));
  EXPECT_EQ(left_of(map, "21"), "20");
  EXPECT_EQ(left_of(map, "22"), "");
  EXPECT_EQ(lane_named(map, "20").right_neighbor, index_of(map, lane_named(map, "21")));
  EXPECT_EQ(lane_named(map, "21").right_neighbor, -1);
  const auto changes = [](TagList tags) { return left_of(import(three_lanes(tags, {})), "21") == "20"; };
  for (const char* subtype : {"dashed", "dashed_solid", "solid_dashed"}) {
    EXPECT_TRUE(changes({{"type", "line_thick"}, {"subtype", subtype}})) << subtype;
  }
  for (const char* subtype : {"solid", "solid_solid", ""}) {
    EXPECT_FALSE(changes({{"type", "line_thick"}, {"subtype", subtype}})) << subtype;
  }
  EXPECT_FALSE(changes({{"type", "virtual"}}));
  EXPECT_FALSE(changes({{"type", "curbstone"}, {"subtype", "low"}}));
  EXPECT_TRUE(changes({{"type", "virtual"}, {"lane_change", "yes"}}));
  EXPECT_FALSE(changes({{"type", "line_thin"}, {"subtype", "dashed"}, {"lane_change", "no"}}));
  EXPECT_TRUE(changes({{"type", "line_thin"}, {"lane_change:left", "no"}, {"lane_change:right", "yes"}}));
  EXPECT_FALSE(changes({{"type", "line_thin"}, {"lane_change:left", "no"}, {"lane_change:right", "no"}}));
}

TEST(Lanelet2, LanesWithSharedBorderPointsAreLinked) {
  OsmText text;
  text.node(1, 0, 3).node(2, 50, 3).node(3, 100, 3).node(4, 0, 0).node(5, 50, 0).node(6, 100, 0);
  text.node(7, 90, 20).node(8, 93, 18);
  text.way(11, {1, 2}).way(12, {4, 5}).way(13, {2, 3}).way(14, {5, 6}).way(15, {2, 7}).way(16, {5, 8});
  text.lanelet(20, 11, 12).lanelet(21, 13, 14).lanelet(22, 15, 16).lanelet(23, 13, 14, {{"subtype", "walkway"}});
  const RoadMap map = sound(text);
  EXPECT_THAT(names_of(map, map.links(lane_named(map, "20").successors)), UnorderedElementsAre("21", "22"));
  EXPECT_THAT(names_of(map, map.links(lane_named(map, "22").predecessors)), ElementsAre("20"));
  EXPECT_THAT(names_of(map, map.links(lane_named(map, "23").predecessors)), IsEmpty());  // no walkway continues a road
  // Lanes that fork share an end and do not cross.
  EXPECT_EQ(map.facts.junctions, 0);
}

TEST(Lanelet2, LanesThatMeetWithoutSharedPointsAreReported) {
  OsmText text;
  text.node(1, 0, 3).node(2, 50, 3).node(4, 0, 0).node(5, 50, 0);
  text.node(102, 50, 3).node(3, 100, 3).node(105, 50, 0).node(6, 100, 0);
  text.way(11, {1, 2}).way(12, {4, 5}).way(13, {102, 3}).way(14, {105, 6}).lanelet(20, 11, 12).lanelet(21, 13, 14);
  const RoadMap map = repaired(text, RepairKind::missing_link);
  EXPECT_THAT(map.mends[0].message, HasSubstr("lanelet 20: <relation>: ends 0.00 m from the start of lanelet 21"));
  EXPECT_EQ(map.mends[0].line, 15);
}

TEST(Lanelet2, TwoWayLaneletsBecomeOneLanePerDirection) {
  OsmText text;
  text.node(1, 0, 5).node(2, 50, 5).node(3, 100, 5).node(4, 0, 0).node(5, 50, 0).node(6, 100, 0);
  text.way(11, {1, 2}).way(12, {4, 5}).way(13, {2, 3}).way(14, {5, 6});
  text.lanelet(20, 11, 12, {{"one_way", "no"}}).lanelet(21, 13, 14, {{"one_way", "no"}});
  const RoadMap map = sound(text);
  ASSERT_EQ(map.lanes.size(), 4u);
  const Lane &there = lane_named(map, "20", 1), &back = lane_named(map, "21", -1);
  EXPECT_THAT(names_of(map, map.links(there.successors)), ElementsAre("21"));
  EXPECT_THAT(names_of(map, map.links(back.successors)), ElementsAre("20"));
  EXPECT_EQ(map.links(back.successors)[0], index_of(map, lane_named(map, "20", -1)));
  EXPECT_NEAR(std::fabs(map.points_of(back)[0].heading_rad), kPi, 1e-6);
  EXPECT_NEAR(in_file(map, map.points_of(back)[0].position_m).x, 100, 1e-4);
  EXPECT_FALSE(back.in_junction);  // both ways share a center line, and do not cross
  // Traffic leaves and enters at both ends.
  EXPECT_EQ(count_lane_use(map).open, 4);
  EXPECT_NEAR(edge_length_m(map), 200, 0.01);
  EXPECT_EQ(map.facts.roads, 2);
  EXPECT_EQ(sound(street({{"subtype", "walkway"}, {"one_way", "no"}})).lanes.size(), 1u);
}

TEST(Lanelet2, LimitsComeFromElementsTagsAndPlaces) {
  const auto limit_kmh = [](const TagList& tags, const TagList& rule = {}) {
    OsmText text = street();
    text.relation(30, {}, rule).lanelet(21, 11, 12, tags, rule.empty() ? std::vector<int>{} : std::vector<int>{30});
    return lane_named(sound(text), "21").speed_limit_mps * 3.6f;
  };
  EXPECT_FLOAT_EQ(limit_kmh({{"speed_limit", "30"}}), 30);
  EXPECT_FLOAT_EQ(limit_kmh({{"speed_limit", "30.00 km/h"}}), 30);
  EXPECT_FLOAT_EQ(limit_kmh({{"speed_limit", "25 mph"}}), 25 * 1.609344f);
  EXPECT_FLOAT_EQ(limit_kmh({{"speed_limit", "10mps"}}), 36);
  EXPECT_FLOAT_EQ(limit_kmh({{"speed_limit", "20 m/s"}}), 72);
  EXPECT_FLOAT_EQ(limit_kmh({{"speed_limit", "30"}, {"speed_limit:vehicle", "40"}}), 40);
  EXPECT_FLOAT_EQ(limit_kmh({{"location", "urban"}}), 50);
  EXPECT_FLOAT_EQ(limit_kmh({{"location", "nonurban"}}), 100);
  EXPECT_FLOAT_EQ(limit_kmh({{"location", "nonurban"}, {"subtype", "highway"}}), 130);
  EXPECT_FLOAT_EQ(limit_kmh({{"subtype", "play_street"}}), 7);
  EXPECT_FLOAT_EQ(limit_kmh({{"location", "private"}}), 54);
  EXPECT_FLOAT_EQ(limit_kmh({{"speed_limit", "30"}}, {{"subtype", "speed_limit"}, {"sign_type", "60 km/h"}}), 60);
  EXPECT_FLOAT_EQ(limit_kmh({}, {{"subtype", "speed_limit"}, {"sign_type", "de274-70"}}), 70);
  EXPECT_FLOAT_EQ(limit_kmh({}, {{"subtype", "speed_limit"}, {"sign_type", "de274_1"}}), 30);
  EXPECT_FLOAT_EQ(limit_kmh({}, {{"subtype", "speed_limit"}, {"sign_type", "60"}, {"dynamic", "yes"}}), 50);
  OsmText by_sign = street();
  by_sign.node(8, 20, -1).node(9, 21, -1).way(40, {8, 9}, {{"type", "traffic_sign"}, {"subtype", "de274-80"}});
  by_sign.relation(30, {{"way", "refers", 40}}, {{"type", "regulatory_element"}, {"subtype", "speed_limit"}});
  by_sign.lanelet(21, 11, 12, {}, {30});
  EXPECT_FLOAT_EQ(lane_named(sound(by_sign), "21").speed_limit_mps * 3.6f, 80);
}

TEST(Lanelet2, SubtypesAndParticipantsGiveTheLanesType) {
  const auto type_of = [](const TagList& tags) { return sound(street(tags)).lanes[0].type; };
  for (const char* subtype : {"road", "highway", "play_street", "exit", "bus_lane"}) {
    EXPECT_EQ(type_of({{"subtype", subtype}}), LaneType::driving) << subtype;
  }
  EXPECT_EQ(type_of({{"subtype", "bicycle_lane"}}), LaneType::biking);
  EXPECT_EQ(type_of({{"subtype", "walkway"}}), LaneType::sidewalk);
  EXPECT_EQ(type_of({{"subtype", "emergency_lane"}}), LaneType::restricted);
  EXPECT_EQ(type_of({{"subtype", "road_shoulder"}, {"participant:vehicle", "yes"}}), LaneType::shoulder);
  EXPECT_EQ(type_of({{"participant:vehicle:emergency", "yes"}}), LaneType::restricted);
  EXPECT_EQ(type_of({{"participant:vehicle:car", "yes"}}), LaneType::driving);
  EXPECT_EQ(type_of({{"participant:bicycle", "yes"}, {"participant:pedestrian", "yes"}}), LaneType::biking);
  EXPECT_EQ(type_of({{"subtype", "walkway"}, {"participant:vehicle", "yes"}}), LaneType::driving);
  EXPECT_EQ(type_of({{"participant:vehicle", "no"}, {"participant:pedestrian", "yes"}}), LaneType::sidewalk);
}

/// Lengths of the markings.
std::vector<double> lengths_of(const RoadMap& map) {
  std::vector<double> lengths;
  for (const Marking& marking : map.markings) {
    double sum = 0;
    for (int32_t i = marking.points.begin + 1; i < marking.points.end; ++i) {
      sum += static_cast<double>(length(map.marking_points[i] - map.marking_points[i - 1]));
    }
    lengths.push_back(sum);
  }
  return lengths;
}

TEST(Lanelet2, LinesArePainted) {
  const auto painted = [](const TagList& tags) { return sound(street({}, tags)); };
  const RoadMap solid = painted({{"type", "line_thin"}, {"subtype", "solid"}});
  ASSERT_EQ(solid.markings.size(), 1u);
  EXPECT_FLOAT_EQ(solid.markings[0].width_m, 0.12f);
  EXPECT_FALSE(solid.markings[0].broken);
  EXPECT_EQ(solid.markings[0].color, MarkColor::white);
  EXPECT_NEAR(lengths_of(solid)[0], std::hypot(100, 2), 1e-3);
  EXPECT_EQ(solid.provenance.markings[0].line, 7);
  const RoadMap dashed = painted({{"type", "line_thick"}, {"subtype", "dashed"}, {"color", "yellow"}});
  ASSERT_EQ(dashed.markings.size(), 9u);  // dashes of 3 m every 12 m, in the middle of 100 m
  EXPECT_FLOAT_EQ(dashed.markings[0].width_m, 0.25f);
  EXPECT_EQ(dashed.markings[0].color, MarkColor::yellow);
  EXPECT_TRUE(dashed.markings[0].broken);
  EXPECT_NEAR(in_file(dashed, dashed.marking_points[0]).x, 0.5, 1e-4);
  for (const double length_m : lengths_of(dashed)) EXPECT_NEAR(length_m, 3, 2e-3);
  // The first word is the left stripe, a width from the middle on each side.
  const RoadMap double_line = painted({{"type", "line_thin"}, {"subtype", "solid_dashed"}, {"width", "0.2"}});
  ASSERT_EQ(double_line.markings.size(), 10u);
  EXPECT_FALSE(double_line.markings[0].broken);
  EXPECT_NEAR(in_file(double_line, double_line.marking_points[0]).y, 3.7, 1e-4);
  EXPECT_TRUE(double_line.markings[1].broken);
  EXPECT_NEAR(in_file(double_line, double_line.marking_points[double_line.markings[1].points.begin]).y, 3.3, 1e-4);
  for (const TagList& none : {TagList{{"type", "virtual"}}, {{"type", "road_border"}}, {{"type", "arrow"}}, {}}) {
    EXPECT_TRUE(painted(none).markings.empty());
  }
}

TEST(Lanelet2, DashesBeginAndEndAtTheirTaggedPoints) {
  OsmText text = street();
  text.node(30, 0, 1).node(31, 10, 1, 0, "begin").node(32, 14, 1, 0, "end").node(33, 20, 1, 0, "start");
  text.node(34, 25, 1, 0, "end").node(35, 90, 1);
  const RoadMap map = sound(text.way(50, {30, 31, 32, 33, 34, 35}, {{"type", "line_thin"}, {"subtype", "dashed"}}));
  ASSERT_EQ(map.markings.size(), 2u);
  EXPECT_NEAR(in_file(map, map.marking_points[map.markings[0].points.begin]).x, 10, 1e-4);
  EXPECT_NEAR(in_file(map, map.marking_points[map.markings[1].points.begin]).x, 20, 1e-4);
  EXPECT_NEAR(lengths_of(map)[0], 4, 1e-4);
  EXPECT_NEAR(lengths_of(map)[1], 5, 1e-4);
}

TEST(Lanelet2, CrosswalksStopLinesAndParkingSpacesAreRead) {
  OsmText text = street();
  text.node(30, 40, 3.5).node(31, 40, 0).node(32, 44, 3.5).node(33, 44, 0);
  text.way(51, {30, 31}, {{"type", "pedestrian_marking"}}).way(52, {32, 33}, {{"type", "zebra_marking"}});
  text.lanelet(60, 52, 51, {{"subtype", "crosswalk"}, {"participant:pedestrian", "yes"}});
  text.node(34, 38, 3.5).node(35, 38, 0).way(53, {34, 35}, {{"type", "stop_line"}, {"width", "0.5"}});
  text.node(36, 60, -3).node(37, 65, -3).way(54, {36, 37}, {{"type", "parking_space"}, {"width", "2.5"}});
  const RoadMap map = sound(text);
  EXPECT_EQ(map.lanes.size(), 1u);
  ASSERT_EQ(map.crosswalks.size(), 1u);
  EXPECT_EQ(map.crosswalks[0].outline.size(), 4);
  EXPECT_TRUE(map.markings.empty());  // the outline of the crosswalk is drawn instead
  ASSERT_EQ(map.stop_lines.size(), 1u);
  EXPECT_FLOAT_EQ(map.stop_lines[0].width_m, 0.5f);
  EXPECT_NEAR(in_file(map, map.stop_lines[0].a_m).x, 38, 1e-4);
  ASSERT_EQ(map.parking_spaces.size(), 1u);
  EXPECT_FLOAT_EQ(map.parking_spaces[0].length_m, 5);
  EXPECT_FLOAT_EQ(map.parking_spaces[0].width_m, 2.5f);
  EXPECT_NEAR(in_file(map, map.parking_spaces[0].center_m).x, 62.5, 1e-4);
}

/// A parking area of 20 x 10 m on the right of the street, from x = 40 to 60, with a hole of 2 x 2 m.
OsmText street_with_area(const std::string& subtype, bool has_hole = false) {
  OsmText text;
  text.node(1, 0, 3.5).node(2, 100, 3.5).node(3, 0, 0).node(4, 100, 0);
  text.node(5, 40, 0).node(6, 60, 0).node(7, 60, -10).node(8, 40, -10);
  text.node(11, 50, -4).node(12, 52, -4).node(13, 52, -6).node(14, 50, -6);
  text.way(11, {1, 2}).way(12, {3, 5, 6, 4}).lanelet(20, 11, 12);
  text.way(13, {5, 6}).way(14, {8, 7, 6}).way(15, {5, 8}).way(16, {11, 12, 13, 14, 11});
  std::vector<test::OsmMember> members{{"way", "outer", 13}, {"way", "outer", 14}, {"way", "outer", 15}};
  if (has_hole) members.push_back({"way", "inner", 16});
  return text.relation(30, members, {{"type", "multipolygon"}, {"subtype", subtype}});
}

TEST(Lanelet2, AreasForVehiclesAreRoad) {
  // The shared 20 m of the border are open: 100 + 80 m beside the lane, 40 m around the area.
  for (const char* subtype : {"parking", "freespace", "road"}) {
    EXPECT_NEAR(edge_length_m(sound(street_with_area(subtype))), 220, 0.05) << subtype;
  }
  for (const char* subtype : {"vegetation", "building", "walkway", "traffic_island"}) {
    EXPECT_NEAR(edge_length_m(sound(street_with_area(subtype))), 200, 0.05) << subtype;
  }
  const RoadMap holed = sound(street_with_area("parking", true));
  EXPECT_NEAR(edge_length_m(holed), 228, 0.05);
  // The road is on the right of each edge of the hole.
  int around = 0;
  for (const RoadEdge& edge : holed.road_edges) {
    const Vec3 a = in_file(holed, edge.a_m), b = in_file(holed, edge.b_m);
    if (a.x < 49 || a.x > 53 || a.y > -3 || a.y < -7) continue;
    ++around;
    EXPECT_GT(cross((b - a).xy(), Vec2{51, -5} - a.xy()), 0);
  }
  EXPECT_EQ(around, 4);
}

TEST(Lanelet2, BarriersBetweenLanesAreEdgesOfBoth) {
  for (const auto& [type, subtype, is_barrier] : {std::tuple{"guard_rail", "", true},
                                                  {"fence", "", true},
                                                  {"wall", "", true},
                                                  {"road_border", "", true},
                                                  {"curbstone", "high", true},
                                                  {"curbstone", "low", false},
                                                  {"line_thin", "solid", false}}) {
    const RoadMap map = sound(three_lanes({{"type", type}, {"subtype", subtype}}, {}));
    EXPECT_NEAR(edge_length_m(map), is_barrier ? 240 : 120, 0.05) << type << " " << subtype;
  }
}

/// A crossing of a street to the east (20, 21, 22) and one to the north (30, 31, 32), with lanes of 4 m from -60 to
/// -10, to 10 and to 60 m, stop lines 11 m before the middle, and lights 12 m beyond it.
OsmText crossing(bool inner_lanes_refer = false, bool has_stop_lines = true, const std::string& head_type = "refers") {
  OsmText text;
  int id = 1;
  for (const int street_id : {20, 30}) {
    const bool is_east = street_id == 20;
    const auto node = [&](double along, double left, double z = 0) {
      is_east ? text.node(id, along, left, z) : text.node(id, -left, along, z);
      return id++;
    };
    std::vector<int> left, right;
    for (const double along : {-60.0, -10.0, 10.0, 60.0}) {
      left.push_back(node(along, 2));
      right.push_back(node(along, -2));
    }
    const int stop_a = node(-11, -2), stop_b = node(-11, 2);  // the right end first
    const int head_a = node(12, 0.5, 5), head_b = node(12, -0.5, 5), lamp_a = node(-10, -3, 3),
              lamp_b = node(-10, -4, 3);
    text.way(street_id + 500, {stop_a, stop_b}, {{"type", "stop_line"}});
    text.way(street_id + 600, {lamp_a, lamp_b}, {{"type", "traffic_light"}});
    text.way(street_id + 601, {head_a, head_b}, {{"type", "traffic_light"}});
    for (int i = 0; i < 3; ++i) {
      text.way(100 * (i + 1) + street_id, {left[i], left[i + 1]})
          .way(100 * (i + 1) + street_id + 1, {right[i], right[i + 1]});
    }
    std::vector<test::OsmMember> members{{"way", head_type, street_id + 600}, {"way", head_type, street_id + 601}};
    if (has_stop_lines) members.push_back({"way", "ref_line", street_id + 500});
    text.relation(street_id + 700, members, {{"type", "regulatory_element"}, {"subtype", "traffic_light"}});
    for (int i = 0; i < 3; ++i) {
      std::vector<int> rules;
      if (i == (inner_lanes_refer ? 1 : 0)) rules = {street_id + 700};
      text.lanelet(street_id + i, 100 * (i + 1) + street_id, 100 * (i + 1) + street_id + 1, {}, rules);
    }
  }
  return text;
}

TEST(Lanelet2, JunctionsOfTwoWayLaneletsHaveALaneletsName) {
  OsmText text;
  const auto lanelet = [&text](int id, double x, double y, double dx, double dy) {
    const double length = std::hypot(dx, dy), left_x = -2 * dy / length, left_y = 2 * dx / length;
    text.node(10 * id, x + left_x, y + left_y).node(10 * id + 1, x + dx + left_x, y + dy + left_y);
    text.node(10 * id + 2, x - left_x, y - left_y).node(10 * id + 3, x + dx - left_x, y + dy - left_y);
    text.way(10 * id + 4, {10 * id, 10 * id + 1}).way(10 * id + 5, {10 * id + 2, 10 * id + 3});
    text.lanelet(id, 10 * id + 4, 10 * id + 5, {{"one_way", "no"}});
  };
  for (int id = 101; id <= 110; ++id) lanelet(id, 0, 50.0 * (id - 100), 30, 0);
  lanelet(111, 100, 0, 40, 0);
  lanelet(112, 120, -20, 0, 40);
  const RoadMap map = import(text);
  ASSERT_EQ(map.junctions.size(), 1u);
  EXPECT_EQ(map.junctions[0].name, "111");
}

TEST(Lanelet2, LightsHaveStopLinesHeadsLanesAndPhases) {
  for (const bool inner_lanes_refer : {false, true}) {
    const RoadMap map = sound(crossing(inner_lanes_refer));
    ASSERT_EQ(map.lights.size(), 2u);
    ASSERT_EQ(map.junctions.size(), 1u);
    EXPECT_EQ(map.junctions[0].name, "21");
    EXPECT_EQ(map.junctions[0].num_phases, 2);
    EXPECT_TRUE(lane_named(map, "21").in_junction);
    EXPECT_TRUE(lane_named(map, "31").in_junction);
    EXPECT_FALSE(lane_named(map, "20").in_junction);
    const TrafficLight &east = map.lights[0], &north = map.lights[1];
    EXPECT_EQ(east.name, "720");
    EXPECT_EQ(east.junction, 0);
    EXPECT_NE(east.phase, north.phase);
    EXPECT_THAT(names_of(map, {map.light_lanes.data() + east.lanes.begin, 2}), ElementsAre("20", "21"));
    EXPECT_EQ(east.lanes.size(), 2);
    const Vec3 a = in_file(map, east.stop_a_m), b = in_file(map, east.stop_b_m), head = in_file(map, east.head_m);
    EXPECT_NEAR(a.x, -11, 1e-4);
    EXPECT_NEAR(a.y, 2, 1e-4);  // the left end
    EXPECT_NEAR(b.y, -2, 1e-4);
    EXPECT_NEAR(east.stop_heading_rad, 0, 1e-6);
    EXPECT_NEAR(head.x, 12, 1e-4);  // the head beyond the crossing, of two
    EXPECT_NEAR(head.y, 0, 1e-4);
    EXPECT_NEAR(head.z, 5, 1e-4);
    EXPECT_NEAR(east.head_facing.x, -1, 1e-6);
    EXPECT_NEAR(north.head_facing.y, -1, 1e-6);
    EXPECT_NEAR(in_file(map, north.stop_a_m).x, -2, 1e-4);
    EXPECT_NEAR(in_file(map, north.head_m).y, 12, 1e-4);
  }
}

TEST(Lanelet2, LightsWithoutStopLinesHoldTrafficAtTheEndOfTheirLanes) {
  const RoadMap map = sound(crossing(false, false));
  ASSERT_EQ(map.lights.size(), 2u);
  EXPECT_NEAR(in_file(map, map.lights[0].stop_a_m).x, -10, 1e-4);
  EXPECT_NEAR(in_file(map, map.lights[0].stop_a_m).y, 2, 1e-4);
  EXPECT_NEAR(in_file(map, map.lights[0].stop_b_m).y, -2, 1e-4);
}

TEST(Lanelet2, LightsOfOneStopLineAreMerged) {
  // Autoware's maps have an element for each way on.
  OsmText text = crossing(true);
  text.relation(800, {{"way", "refers", 621}, {"way", "ref_line", 520}},
                {{"type", "regulatory_element"}, {"subtype", "traffic_light"}});
  text.node(90, 10, 14).node(91, 12, 10).way(900, {3, 90}).way(901, {4, 91}).lanelet(23, 900, 901, {}, {800});
  const RoadMap map = sound(text);
  ASSERT_EQ(map.lights.size(), 2u);
  EXPECT_THAT(names_of(map, {map.light_lanes.data() + map.lights[0].lanes.begin, 3}), ElementsAre("20", "21", "23"));
}

TEST(Lanelet2, HeadsOnTheGroundAreRaised) {
  OsmText text = street({}, {});
  text.node(30, 90, 3.5, 8.8).node(31, 90, 0, 8.8).way(40, {30, 31}, {{"type", "stop_line"}});
  text.node(32, 92, 4, 8.8).node(33, 92, 5, 8.8).way(41, {32, 33}, {{"type", "traffic_light"}});
  text.relation(50, {{"way", "refers", 41}, {"way", "ref_line", 40}}, {{"subtype", "traffic_light"}});
  const RoadMap map = sound(text.lanelet(21, 11, 12, {}, {50}));
  ASSERT_EQ(map.lights.size(), 1u);
  EXPECT_NEAR(in_file(map, map.lights[0].head_m).z, 8.8 + 3.5, 1e-4);
  EXPECT_EQ(map.lights[0].junction, -1);
}

TEST(Lanelet2, PedestrianLightsAreIgnored) {
  OsmText text = street();
  text.node(30, 40, 3.5).node(31, 40, 0).node(32, 44, 3.5).node(33, 44, 0).way(51, {30, 31}).way(52, {32, 33});
  text.relation(50, {{"way", "refers", 51}}, {{"subtype", "traffic_light"}});
  EXPECT_TRUE(sound(text.lanelet(60, 52, 51, {{"subtype", "crosswalk"}}, {50})).lights.empty());
}

TEST(Lanelet2, SignsHaveTheirRegionNumberAndLanes) {
  OsmText text = street();
  text.node(30, 80, -1, 2).node(31, 80, -2, 2);
  text.way(41, {30, 31}, {{"type", "traffic_sign"}, {"subtype", "de206"}});
  text.way(42, {30, 31}, {{"type", "traffic_sign"}, {"subtype", "usR1-1"}});
  text.way(43, {30, 31}, {{"type", "traffic_sign"}, {"subtype", "stop_sign"}});
  text.relation(50, {{"way", "refers", 41}}, {{"type", "regulatory_element"}, {"subtype", "right_of_way"}});
  const RoadMap map = sound(text.lanelet(21, 11, 12, {}, {50}));
  ASSERT_EQ(map.signs.size(), 3u);
  EXPECT_EQ(map.signs[0].type, "206");
  EXPECT_EQ(map.signs[0].country, "DE");
  EXPECT_EQ(map.signs[0].name, "41");
  EXPECT_THAT(names_of(map, {map.sign_lanes.data(), map.sign_lanes.size()}), ElementsAre("21"));
  EXPECT_NEAR(in_file(map, map.signs[0].position_m).y, -1.5, 1e-4);
  EXPECT_EQ(map.signs[1].type, "R1-1");
  EXPECT_EQ(map.signs[1].country, "US");
  EXPECT_NEAR(map.signs[1].heading_rad, 0, 1e-6);  // seen from the west its left edge is in the north
  EXPECT_EQ(map.signs[2].type, "206");
  EXPECT_EQ(map.signs[2].country, "OpenDRIVE");
}

// Coordinates of PROJ 9.5 and codes of NGA's mgrs.
struct ProjectedPlace {
  double lat, lon;
  int zone;
  bool is_south;
  double x_m, y_m;
  const char* mgrs;
};
const std::vector<ProjectedPlace> kPlaces{
    {49.00345654351, 8.42427590707, 32, false, 457893.098208, 5427999.699296, "32UMV5789327999"},
    {35.6762, 139.6503, 54, false, 377855.775952, 3948874.392162, "54SUE7785548874"},
    {-33.8568, 151.2153, 56, true, 334900.569652, 6252288.752888, "56HLH3490052288"},
    {60.3913, 5.3221, 32, false, 297353.932729, 6700648.345232, "32VKN9735300648"},
    {78.2232, 15.6267, 33, false, 514278.715113, 8683355.469471, "33XWG1427883355"},
    {0.5, -179.9, 1, false, 177176.037447, 55336.377566, "01NAA7717655336"},
    {83.9, 12.0, 33, false, 464424.319810, 9317856.466148, "33XVP6442417856"},
    {-79.5, -60.01, 20, true, 560803.361967, 1172660.633654, "20CNS6080372660"},
};

TEST(Lanelet2Projection, UtmAgreesWithProj) {
  for (const ProjectedPlace& place : kPlaces) {
    const UtmZone zone = utm_zone_of({place.lat, place.lon});
    EXPECT_EQ(zone.number, place.zone) << place.mgrs;
    EXPECT_EQ(zone.is_south, place.is_south) << place.mgrs;
    const GridPoint point = to_utm({place.lat, place.lon}, zone);
    EXPECT_NEAR(point.x_m, place.x_m, 2e-6) << place.mgrs;
    EXPECT_NEAR(point.y_m, place.y_m, 2e-6) << place.mgrs;
  }
}

TEST(Lanelet2Projection, MgrsCodesNameTheirSquare) {
  for (const ProjectedPlace& place : kPlaces) {
    const std::optional<MgrsPlace> found = parse_mgrs(place.mgrs);
    ASSERT_TRUE(found) << place.mgrs;
    EXPECT_EQ(found->zone.number, place.zone);
    EXPECT_EQ(found->square_m.x_m + found->offset_m.x_m, std::floor(place.x_m)) << place.mgrs;
    EXPECT_EQ(found->square_m.y_m + found->offset_m.y_m, std::floor(place.y_m)) << place.mgrs;
  }
  for (const char* none :
       {"", "54", "99XXX123456", "54SVE123", "54SVE12-456", "61SVE", "54IVE", "54SAE", "54SVE123456789012", "32UML"}) {
    EXPECT_FALSE(parse_mgrs(none)) << none;
  }
}

/// A street of 100 m to the east from a place, whose points have no local coordinates.
std::string geographic_street(double lat, double lon) {
  const double east = 100 / (111319.5 * std::cos(lat * kPi / 180)), north = 4 / 111200.0;
  std::string text = "<osm>\n";
  int id = 1;
  for (const auto& [dx, dy] : {std::pair{0.0, north}, {east, north}, {0.0, 0.0}, {east, 0.0}}) {
    text += fmt::format("<node id=\"{}\" lat=\"{:.12f}\" lon=\"{:.12f}\"/>\n", id++, lat + dy, lon + dx);
  }
  return text + R"(<way id="11"><nd ref="1"/><nd ref="2"/></way><way id="12"><nd ref="3"/><nd ref="4"/></way>
<relation id="20"><member type="way" ref="11" role="left"/><member type="way" ref="12" role="right"/>
<tag k="type" v="lanelet"/><tag k="subtype" v="road"/></relation></osm>)";
}

TEST(Lanelet2, CoordinatesAreUtmOrAboutAnOrigin) {
  const std::string text = geographic_street(49.00345654351, 8.42427590707);
  const RoadMap utm = parse_lanelet2(text, "road.osm");
  EXPECT_NEAR(utm.lanes[0].length_m, 100, 0.2);
  const Vec3 start = utm.points_of(utm.lanes[0])[0].position_m;
  EXPECT_NEAR(static_cast<double>(start.x) + utm.origin_m[0], 457893.098, 0.05);
  EXPECT_NEAR(static_cast<double>(start.y) + utm.origin_m[1], 5427999.699 + 2, 0.05);
  EXPECT_EQ(utm.geo_reference, "+proj=utm +zone=32 +datum=WGS84 +units=m +no_defs");
  const RoadMap local = parse_lanelet2(text, "road.osm", {}, GeoPoint{49.00345654351, 8.42427590707});
  const Vec3 local_start = local.points_of(local.lanes[0])[0].position_m;
  EXPECT_NEAR(static_cast<double>(local_start.x) + local.origin_m[0], 0, 0.05);
  EXPECT_NEAR(static_cast<double>(local_start.y) + local.origin_m[1], 2, 0.05);
  EXPECT_EQ(
      local.geo_reference,
      "+proj=tmerc +lat_0=0 +lon_0=9 +k=0.9996 +x_0=42106.9018 +y_0=-5427999.6993 +datum=WGS84 +units=m +no_defs");
}

TEST(Lanelet2, MgrsCodesGiveTheReferenceOrThePlace) {
  std::string text = street().text();
  const auto tagged = [&](const std::string& code) {
    std::string copy = text;
    copy.insert(copy.find("</node>"), fmt::format(R"(<tag k="mgrs_code" v="{}"/>)", code));
    return parse_lanelet2(copy, "road.osm").geo_reference;
  };
  // The square 54SVE is at 400 km east, 3900 km north.
  EXPECT_EQ(
      tagged("54SVE0000000004"),
      "+proj=tmerc +lat_0=0 +lon_0=141 +k=0.9996 +x_0=100000.0000 +y_0=-3900000.0000 +datum=WGS84 +units=m +no_defs");
  EXPECT_EQ(tagged("99XXX0000000000"), "");
  std::string codes = "<osm>";
  int id = 1;
  for (const char* code : {"54SVE1000020004", "54SVE1010020004", "54SVE1000020000", "54SVE1010020000"}) {
    codes += fmt::format(R"(<node id="{}"><tag k="mgrs_code" v="{}"/></node>)", id++, code);
  }
  codes += R"(<way id="11"><nd ref="1"/><nd ref="2"/></way><way id="12"><nd ref="3"/><nd ref="4"/></way>
<relation id="20"><member type="way" ref="11" role="left"/><member type="way" ref="12" role="right"/>
<tag k="type" v="lanelet"/></relation></osm>)";
  const RoadMap map = parse_lanelet2(codes, "road.osm");
  EXPECT_FLOAT_EQ(map.lanes[0].length_m, 100);
  EXPECT_EQ(map.origin_m, (std::array<double, 3>{410050, 3920002, 0}));
}

TEST(Lanelet2, MapNamesLoadCachedFilesAndCopies) {
  const ScratchFolder folder;
  const EnvironmentVariable cache("XDG_CACHE_HOME", folder / "cache"), on("PICTURA_CACHE", std::nullopt);
  const std::string path = folder / "street.osm";
  write_file(path, geographic_street(49, 8.4));
  LoadReport report;
  const auto first = load_map(path, {}, &report);
  EXPECT_FALSE(report.cached);
  EXPECT_EQ(first->name, "street");
  const auto again = load_map(path, {}, &report);
  EXPECT_TRUE(report.cached);
  EXPECT_EQ(first_difference(*first, *again), "");
  const auto about = load_map(path + "@49,8.4", {}, &report);
  EXPECT_FALSE(report.cached);
  EXPECT_NEAR(about->origin_m[0], 50, 1);
  EXPECT_EQ(about->name, "street");
  const auto other = load_map(path + "@49.001,8.4", {}, &report);
  EXPECT_FALSE(report.cached);
  EXPECT_NEAR(other->origin_m[1], about->origin_m[1] - 111.2, 1.5);
  EXPECT_NEAR(load_map(path + "@49,8.4", {}, &report)->origin_m[0], 50, 1);
  EXPECT_TRUE(report.cached);
  const auto copy = load_map(path + "@49,8.4#1");
  EXPECT_EQ(copy->name, "street#1");
  EXPECT_EQ(copy->geo_reference, "");
  EXPECT_GT(std::fabs(copy->points_of(copy->lanes[0])[0].heading_rad), 1e-3f);
  for (const char* suffix : {"", "@49,8.4", "#2", "@-33.5,151#2"}) EXPECT_TRUE(is_map_file(path + suffix)) << suffix;
  for (const char* suffix : {"@", "@49", "@49,x", "@91,8", "@49,181", "@49,8,4"}) {
    EXPECT_THAT(error_message([&] { load_map(path + suffix); }), HasSubstr("expected @LATITUDE,LONGITUDE")) << suffix;
  }
  EXPECT_THAT(error_message([&] { map_text(path); }), HasSubstr("expected an OpenDRIVE map, got one of Lanelet2"));
  EXPECT_GT(map_file_bytes(path + "@49,8.4"), 100);
}

TEST(Lanelet2, FaultsWithOneMeaningAreRepaired) {
  const auto with = [](const std::function<void(OsmText*)>& add) {
    OsmText text = street();
    add(&text);
    return text;
  };
  repaired(with([](OsmText* text) { text->way(11, {3, 4}); }), RepairKind::repeated_element);
  repaired(with([](OsmText* text) { text->node(1, 5, 5); }), RepairKind::repeated_element);
  const RoadMap missing = repaired(with([](OsmText* text) { text->way(30, {1, 77, 2}); }), RepairKind::missing_element);
  EXPECT_EQ(message_of(missing.mends[0], "road.osm"),
            "road.osm:10: way 30: <way>: refers to node 77, which does not exist");
  repaired(with([](OsmText* text) { text->lanelet(21, 11, 12, {}, {99}); }), RepairKind::missing_element);
  repaired(with([](OsmText* text) { text->line(R"(<node id="9" lat="1" lon="2"/>)").way(30, {1, 9, 2}); }),
           RepairKind::missing_position);
  repaired(with([](OsmText* text) { text->way(30, {1}); }), RepairKind::short_way);
  const RoadMap borderless =
      repaired(with([](OsmText* text) {
                 text->relation(21, {{"way", "left", 11}}, {{"type", "lanelet"}, {"subtype", "road"}});
               }),
               RepairKind::borderless_lanelet);
  EXPECT_EQ(borderless.lanes.size(), 1u);
  repaired(with([](OsmText* text) {
             text->node(8, 0, 3.5).way(30, {1, 8}).node(9, 0, 0).way(31, {3, 9}).lanelet(21, 30, 31);
           }),
           RepairKind::empty_lanelet);
  EXPECT_EQ(repaired(street({{"subtype", "canal"}}), RepairKind::unknown_subtype).lanes[0].type, LaneType::other);
  EXPECT_FLOAT_EQ(repaired(street({{"speed_limit", "fast"}}), RepairKind::unreadable_speed).lanes[0].speed_limit_mps,
                  50 / 3.6f);
  // Once for both lanes of a two-way lanelet, and once for a rule of several lanelets.
  repaired(street({{"speed_limit", "fast"}, {"one_way", "no"}}), RepairKind::unreadable_speed);
  repaired(with([](OsmText* text) {
             text->relation(30, {},
                            {{"type", "regulatory_element"}, {"subtype", "speed_limit"}, {"sign_type", "fast"}});
             text->lanelet(21, 11, 12, {}, {30}).lanelet(22, 11, 12, {}, {30});
           }),
           RepairKind::unreadable_speed);
  repaired(street({}, {{"type", "line_thin"}, {"subtype", "solid"}, {"color", "pink"}}), RepairKind::unknown_color);
  repaired(with([](OsmText* text) { text->way(30, {1, 2}, {{"type", "parking_space"}}); }),
           RepairKind::shapeless_object);
  repaired(with([](OsmText* text) {
             text->relation(30, {{"way", "outer", 11}}, {{"type", "multipolygon"}, {"subtype", "parking"}});
           }),
           RepairKind::open_area);
  repaired(with([](OsmText* text) {  // crosses itself
             text->way(30, {1, 2, 3, 4, 1});
             text->relation(31, {{"way", "outer", 30}}, {{"type", "multipolygon"}, {"subtype", "parking"}});
           }),
           RepairKind::open_area);
  repaired(with([](OsmText* text) { text->relation(30, {{"way", "refers", 11}}, {{"subtype", "traffic_light"}}); }),
           RepairKind::laneless_light);
  repaired(with([](OsmText* text) { text->relation(30, {}, {{"subtype", "traffic_light"}}); }), RepairKind::empty_rule);
}

TEST(Lanelet2, DeletedElementsAreIgnored) {
  OsmText text = street();
  text.line(R"(<node id="1" action="delete" lat="0" lon="0"/>)");
  text.line(R"(<relation id="20" action="delete"/>)");
  EXPECT_EQ(sound(text).lanes.size(), 1u);
}

TEST(Lanelet2, OtherFaultsNameFileLineAndElement) {
  const auto refusal = [](const std::string& text) { return error_message([&] { parse_lanelet2(text, "bad.osm"); }); };
  const auto with = [](const std::string& line) {
    OsmText text = street();
    return text.line(line).text();
  };
  EXPECT_EQ(refusal("<osm><node"), "bad.osm:1: expected well-formed XML: Error parsing start element tag");
  EXPECT_EQ(refusal("<gpx/>"), "bad.osm: expected a Lanelet2 map, an XML file whose root is <osm>, got <gpx>");
  EXPECT_EQ(refusal("<osm/>"), "bad.osm: expected a lanelet, found none");
  EXPECT_EQ(refusal(with(R"(<node id="x1"/>)")), "bad.osm:10: <node>: attribute id: expected a whole number, got 'x1'");
  EXPECT_EQ(refusal(with(R"(<node id="9" lat="91" lon="0"/>)")),
            "bad.osm:10: <node>: attribute lat: expected a number of at most 90 in size, got '91'");
  EXPECT_EQ(refusal(with(R"(<node id="9"><tag k="local_x" v="nan"/></node>)")),
            "bad.osm:10: <node>: tag local_x: expected a number of at most 100000000 in size, got 'nan'");
  EXPECT_EQ(refusal(with(R"(<way id="9"><nd ref=""/></way>)")),
            "bad.osm:10: <nd>: attribute ref: expected a whole number, got ''");
  OsmText wide = street();
  wide.node(8, 0, 600).node(9, 100, 600).way(30, {8, 9}).lanelet(21, 30, 12);
  EXPECT_EQ(refusal(wide.text()),
            "bad.osm:13: lanelet 21: <relation>: expected borders at most 500 m apart, got 600.0 m");
  OsmText far = street();
  far.node(8, 0, 90000).way(30, {1, 8});
  EXPECT_THAT(refusal(far.text()), HasSubstr("bad.osm:10: node 8: <node>: expected coordinates within 50 km"));
  EXPECT_THAT(refusal(geographic_street(88, 0)), HasSubstr("expected latitudes in [-80, 84] degrees"));
  EXPECT_THAT(refusal("<!DOCTYPE osm [<!ENTITY a \"b\">]><osm/>"), HasSubstr("a document type"));
  EXPECT_THAT(refusal(OsmText()
                          .node(1, 0, 4)
                          .node(2, 9, 4)
                          .node(3, 0, 0)
                          .node(4, 9, 0)
                          .way(11, {1, 2})
                          .way(12, {3, 4})
                          .lanelet(20, 11, 12, {{"subtype", "crosswalk"}})
                          .text()),
              HasSubstr("expected a lanelet that is no crosswalk"));
}

/// Every piece of a file, and files with a byte changed, give a map or an error that names the file.
TEST(Lanelet2, HostileFilesGiveAMapOrAnError) {
  const auto try_import = [](const std::string& text) {
    try {
      validate(parse_lanelet2(text, "bad.osm"));
      return 1;
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), ::testing::StartsWith("bad.osm"));
      return 0;
    }
  };
  const std::string text = crossing().text();
  int maps = 0;
  for (std::size_t i = 0; i < text.size(); i += 53) maps += try_import(text.substr(0, i));
  EXPECT_EQ(maps, 0);
  uint32_t state = 1;
  for (int i = 0; i < 400; ++i) {
    std::string changed = i % 2 == 0 ? text : street_with_area("parking", true).text();
    for (int k = 0; k < 3; ++k) {
      state = state * 1664525u + 1013904223u;
      changed[state % changed.size()] = "0123456789-.<\"/ e"[(state >> 8) % 17];
    }
    maps += try_import(changed);
  }
  EXPECT_GT(maps, 10);
  // Elements that refer to each other, lanelets on lanelets, and a line that goes back and forth 5,000 times.
  OsmText rings = street();
  rings.relation(90, {{"relation", "regulatory_element", 91}}, {{"type", "lanelet"}})
      .relation(91, {{"relation", "regulatory_element", 90}}, {{"type", "lanelet"}});
  for (int i = 0; i < 20; ++i) rings.lanelet(1000 + i, 11, 12, {{"one_way", "no"}});
  EXPECT_EQ(try_import(rings.text()), 1);
  OsmText zigzag = street();
  std::vector<int> nodes;
  for (int i = 0; i < 5000; ++i) nodes.push_back(i % 2 == 0 ? 1 : 2);
  zigzag.way(30, nodes, {{"type", "line_thin"}, {"subtype", "dashed"}});
  EXPECT_EQ(try_import(zigzag.text()), 0);
  OsmText shared = street();  // by thousands of lanelets
  shared.way(30, nodes).node(8, 0, -9).node(9, 100, -9).way(31, {8, 9});
  for (int i = 0; i < 2000; ++i) shared.lanelet(1000 + i, 30, 31);
  EXPECT_EQ(try_import(shared.text()), 0);
}

TEST(Lanelet2, TheTableListsEveryKindOfFault) {
  const std::string docs = read_file(PICTURA_LANELET2_DOCS);
  for (const RepairKind kind : repair_kinds()) {
    if (kind < kFirstLanelet2Repair) continue;
    EXPECT_THAT(docs, HasSubstr(fmt::format("| {} | {} |", to_string(kind), action_of(kind))));
  }
}

}  // namespace
}  // namespace pictura
