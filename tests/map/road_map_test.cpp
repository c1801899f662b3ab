// validate() on maps with one invalid value each, and load_map() with invalid names.
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/common/error.h"
#include "pictura/map/load_map.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/scratch_folder.h"

namespace pictura {
namespace {

using ::testing::HasSubstr;

TEST(RoadMap, EveryDamageIsFoundAndNamed) {
  RoadMap valid_map = *load_map("procedural:2");
  valid_map.sign_lanes = {0};
  valid_map.signs = {{"1", "206", "-1", "OpenDRIVE", {1, 2, 3}, 0, {0, 1}}};
  valid_map.stop_lines = {{{1, 2, 3}, {4, 5, 6}, 0.3f}};
  valid_map.provenance.signs = {{0, 7}};
  ASSERT_NO_THROW(validate(valid_map));
  ASSERT_FALSE(valid_map.lights.empty());
  ASSERT_FALSE(valid_map.markings.empty());
  std::size_t linked = 0;
  while (valid_map.lanes[linked].successors.size() == 0) ++linked;
  std::size_t alone = 0;
  while (valid_map.lanes[alone].left_neighbor >= 0 || valid_map.lanes[alone].right_neighbor >= 0) ++alone;
  const float nan = std::nanf("");
  const std::vector<std::pair<const char*, std::function<void(RoadMap*)>>> damages = {
      {"points", [](RoadMap* map) { map->lanes[0].points.end = 1 << 30; }},
      {"points", [](RoadMap* map) { map->lanes[0].points = {0, 1}; }},
      {"left_neighbor", [](RoadMap* map) { map->lanes[0].left_neighbor = static_cast<int32_t>(map->lanes.size()); }},
      {"got a ring",
       [&](RoadMap* map) {
         map->lanes[alone].left_neighbor = map->lanes[alone].right_neighbor = static_cast<int32_t>(alone);
       }},
      {"junction", [](RoadMap* map) { map->lanes[0].junction = -2; }},
      {"source_road", [](RoadMap* map) { map->lanes[0].source_road = -1; }},
      {"speed_limit_mps", [&](RoadMap* map) { map->lanes[0].speed_limit_mps = nan; }},
      {"length_m", [](RoadMap* map) { map->lanes[0].length_m = 0; }},
      {"refer back",
       [&](RoadMap* map) { map->lane_links[map->lanes[linked].successors.begin] = static_cast<int32_t>(linked); }},
      {"lane 0", [&](RoadMap* map) { map->lane_points[0].position_m.x = nan; }},
      {"width_m", [](RoadMap* map) { map->lane_points[0].width_m = -1; }},
      {"heading_rad", [](RoadMap* map) { map->lane_points[0].heading_rad = 7; }},
      {"s_m", [](RoadMap* map) { map->lane_points[1].s_m = 0; }},
      {"marking 0", [](RoadMap* map) { map->markings[0].width_m = 0; }},
      {"marking point", [&](RoadMap* map) { map->marking_points[0].z = nan; }},
      {"road edge", [](RoadMap* map) { map->road_edges[0].b_m.x += 50; }},
      {"light 0: phase", [](RoadMap* map) { map->lights[0].phase = 99; }},
      {"light 0: lanes", [](RoadMap* map) { map->lights[0].lanes = {0, 0}; }},
      {"facing", [](RoadMap* map) { map->lights[0].head_facing = {0, 0}; }},
      {"stop line", [](RoadMap* map) { map->lights[0].stop_b_m = map->lights[0].stop_a_m; }},
      {"light lane", [](RoadMap* map) { map->light_lanes[0] = -1; }},
      {"painted stop line 0", [&](RoadMap* map) { map->stop_lines[0].b_m.x = nan; }},
      {"painted stop line 0: width_m", [](RoadMap* map) { map->stop_lines[0].width_m = 0; }},
      {"sign 0: lanes", [](RoadMap* map) { map->signs[0].lanes.end = 2; }},
      {"sign 0: heading_rad", [&](RoadMap* map) { map->signs[0].heading_rad = nan; }},
      {"sign lane 0", [](RoadMap* map) { map->sign_lanes[0] = 1 << 20; }},
      {"1 signs, got 2", [](RoadMap* map) { map->provenance.signs.push_back({}); }},
      {"lanes, got 1", [](RoadMap* map) { map->provenance.lanes = {{0, 1}}; }},
      {"sign 0: source road", [](RoadMap* map) { map->provenance.signs[0].road = 1 << 20; }},
      {"sign 0: source line", [](RoadMap* map) { map->provenance.signs[0].line = -1; }},
  };
  for (const auto& [expected, damage] : damages) {
    RoadMap map = valid_map;
    damage(&map);
    try {
      validate(map);
      ADD_FAILURE() << "not found: " << expected;
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), HasSubstr(expected));
      EXPECT_THAT(error.what(), HasSubstr("procedural:2"));
    }
  }
}

TEST(LoadMap, ProceduralTownsAreNamedByTheirSeed) {
  EXPECT_EQ(load_map("procedural")->name, "procedural:0");
  EXPECT_EQ(load_map("procedural:12")->name, "procedural:12");
  EXPECT_THROW(load_map("procedural:x"), UsageError);
  EXPECT_THROW(load_map("procedural:-1"), UsageError);
  EXPECT_THROW(load_map("procedural:"), UsageError);
}

class LoadMapFiles : public ::testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directory(folder_ / "carla");
    std::ofstream(folder_ / "Here.xodr") << "<OpenDRIVE><road id=\"1\" ";
    std::ofstream(folder_ / "carla/There.xodr") << "<OpenDRIVE/>";
    std::ofstream(folder_ / "picture.png") << "png";
  }
  std::string message_of(const std::string& name) {
    return test::message_of([&] { load_map(name); });
  }
  test::ScratchFolder folder_;
  test::EnvironmentVariable data_{"PICTURA_DATA", folder_.path()};
};

TEST_F(LoadMapFiles, UnknownNamesListTheKnownMaps) {
  EXPECT_THROW(load_map("Nowhere"), UsageError);
  EXPECT_THAT(message_of("Nowhere"), HasSubstr("Here, There"));
  EXPECT_THAT(message_of("Nowhere"), HasSubstr("procedural"));
  EXPECT_THROW(load_map(""), UsageError);
  EXPECT_THROW(load_map("../Here"), UsageError);
  EXPECT_THROW(load_map(folder_ / "picture.png"), UsageError);
  EXPECT_THROW(load_map(folder_.path()), UsageError);
}

TEST_F(LoadMapFiles, BadFilesAreNamed) {
  EXPECT_THAT(message_of("Here"), HasSubstr("Here.xodr:1"));
  EXPECT_THAT(message_of("There"), HasSubstr("There.xodr"));
  EXPECT_THAT(message_of(folder_ / "missing.xodr"), HasSubstr("missing.xodr"));
}

}  // namespace
}  // namespace pictura
