// Roads that end: places where traffic leaves and enters the map, without road edges across them.
#include "pictura/map/open_lanes.h"

#include <cmath>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/map/load_map.h"
#include "pictura/map/opendrive/opendrive.h"
#include "pictura/tests/map/open_roads.h"
#include "pictura/tests/support/error_message.h"

namespace pictura {
namespace {

using ::testing::HasSubstr;

RoadMap map_of(const std::string& text) { return parse_opendrive(text, "open.xodr"); }

/// Number of edges that cross a line slightly beyond, or before, the opening.
int edges_across(const RoadMap& map, const LaneOpening& opening) {
  int count = 0;
  for (const RoadEdge& edge : map.road_edges) {
    const Vec2 middle = (edge.a_m.xy() + edge.b_m.xy()) * 0.5f - opening.middle_m.xy();
    const bool is_across = std::fabs(cross((edge.b_m - edge.a_m).xy(), opening.direction)) > 0.1f;
    count += is_across && std::fabs(dot(middle, opening.direction)) < 0.5f &&
             std::fabs(cross(middle, opening.direction)) < opening.half_width_m;
  }
  return count;
}

void expect_no_edges_across(const RoadMap& map, const OpenLanes& open) {
  for (const LaneOpening& opening : open.exits)
    EXPECT_EQ(edges_across(map, opening), 0) << "exit of lane " << opening.lane;
  for (const LaneOpening& opening : open.entries)
    EXPECT_EQ(edges_across(map, opening), 0) << "entry of lane " << opening.lane;
}

TEST(OpenLanes, AStreetHasAnExitAndAnEntryAtEachEnd) {
  const RoadMap map = map_of(test::open_street());
  EXPECT_FALSE(has_endless_roads(map));
  const OpenLanes open = find_open_lanes(map);
  ASSERT_EQ(open.exits.size(), 2u);
  ASSERT_EQ(open.entries.size(), 2u);
  expect_no_edges_across(map, open);
  // Only the kerbs along both sides remain.
  double length_m = 0;
  for (const RoadEdge& edge : map.road_edges) {
    EXPECT_NEAR(std::fabs(edge.a_m.y), 3.5, 1e-3);
    length_m += length((edge.b_m - edge.a_m).xy());
  }
  EXPECT_NEAR(length_m, 600, 0.01);
  EXPECT_TRUE(map.mends.empty());
  const LaneUse use = count_lane_use(map);
  EXPECT_EQ(use.endless, 0);
  EXPECT_EQ(use.open, 2);
  EXPECT_EQ(use.unreachable, 0);
}

/// The centre lines of the lanes are up to 0.2 rad oblique to the ends of the road.
TEST(OpenLanes, NoEdgeCrossesTheEndsOfLanesThatGetWider) {
  for (const double slope : {-0.05, 0.1, 0.2}) {
    const std::string width =
        fmt::format(R"(<width sOffset="0" a="{}" b="{}" c="0" d="0"/></lane>)", slope < 0 ? 6 : 3.5, slope);
    test::RoadText road;
    road.length = 50;
    road.left = R"(<lane id="2" type="driving">)" + width + R"(<lane id="1" type="driving">)" + width;
    road.right = R"(<lane id="-1" type="driving">)" + width + R"(<lane id="-2" type="driving">)" + width;
    const RoadMap map = map_of(test::file_of(road.text()));
    const OpenLanes open = find_open_lanes(map);
    EXPECT_EQ(open.exits.size(), 4u);
    SCOPED_TRACE(slope);
    expect_no_edges_across(map, open);
  }
}

TEST(OpenLanes, ACrossingHasOneExitAndOneEntryPerArm) {
  const RoadMap map = map_of(test::open_crossing());
  const OpenLanes open = find_open_lanes(map);
  EXPECT_EQ(open.exits.size(), 4u);
  EXPECT_EQ(open.entries.size(), 4u);
  EXPECT_TRUE(open.missing_links.empty());
  expect_no_edges_across(map, open);
  EXPECT_EQ(count_lane_use(map).open, 20);
  for (const LaneOpening& exit : open.exits) EXPECT_NEAR(length(exit.middle_m.xy()), std::hypot(72, 1.75), 0.01);
  for (size_t lane = 0; lane < map.lanes.size(); ++lane) {
    if (open.way_after_m[lane] <= 60) continue;
    EXPECT_NEAR(open.way_after_m[lane], 24 + 60, 0.1) << "straight on, which is longest";
  }
}

TEST(OpenLanes, AMergingLaneIsNotAnExit) {
  const RoadMap map = map_of(test::open_ramp());
  const OpenLanes open = find_open_lanes(map);
  EXPECT_EQ(open.exits.size(), 2u);
  EXPECT_EQ(open.entries.size(), 3u);
  for (const LaneOpening& exit : open.exits) EXPECT_NEAR(exit.middle_m.x - open.entries[0].middle_m.x, 250, 0.01);
  expect_no_edges_across(map, open);
  for (const size_t lane : {0u, 1u, 2u}) EXPECT_NEAR(open.way_after_m[lane], 150, 0.01);
}

TEST(OpenLanes, ShortLanesAreNotOpen) {
  const RoadMap map = map_of(test::open_street(19));
  const OpenLanes open = find_open_lanes(map);
  EXPECT_TRUE(open.entries.empty());
  EXPECT_EQ(count_lane_use(map).unreachable, 2);
}

TEST(OpenLanes, MissingLinksAreNotExitsAndAreCounted) {
  const RoadMap map = map_of(test::unlinked_roads());
  const OpenLanes open = find_open_lanes(map);
  ASSERT_EQ(open.exits.size(), 1u);
  EXPECT_EQ(open.exits[0].lane, 1);
  ASSERT_EQ(map.mends.size(), 1u);
  EXPECT_EQ(map.mends[0].kind, RepairKind::missing_link);
  EXPECT_THAT(message_of(map.mends[0], "open.xodr"),
              HasSubstr("ends 0.30 m from the start of lane -1 of road 2, to which it has no link"));
  EXPECT_THAT(test::message_of([] { parse_opendrive(test::unlinked_roads(), "open.xodr", {.strict = true}); }),
              HasSubstr("to which it has no link"));
}

TEST(OpenLanes, MapsWithEndlessRoadsKeepTheirEdges) {
  const auto town = load_map("procedural:1");
  EXPECT_TRUE(has_endless_roads(*town));
  const LaneUse use = count_lane_use(*town);
  EXPECT_GT(use.endless, 0);
  EXPECT_EQ(use.open, 0);
}

}  // namespace
}  // namespace pictura
