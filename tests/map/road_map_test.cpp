// validate() against maps that are damaged in one place each, and load_map() against names that mean nothing.
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "pictura/common/error.h"
#include "pictura/map/load_map.h"

namespace pictura {
namespace {

using ::testing::HasSubstr;

TEST(RoadMap, EveryDamageIsFoundAndNamed) {
  const RoadMap sound = *load_map("procedural:2");
  ASSERT_NO_THROW(validate(sound));
  ASSERT_FALSE(sound.lights.empty());
  ASSERT_FALSE(sound.markings.empty());
  std::size_t linked = 0;
  while (sound.lanes[linked].successors.size() == 0) ++linked;
  const float nan = std::nanf("");
  const std::vector<std::pair<const char*, std::function<void(RoadMap*)>>> damages = {
      {"points", [](RoadMap* map) { map->lanes[0].points.end = 1 << 30; }},
      {"points", [](RoadMap* map) { map->lanes[0].points = {0, 1}; }},
      {"left_neighbor", [](RoadMap* map) { map->lanes[0].left_neighbor = static_cast<int32_t>(map->lanes.size()); }},
      {"junction", [](RoadMap* map) { map->lanes[0].junction = -2; }},
      {"source_road", [](RoadMap* map) { map->lanes[0].source_road = -1; }},
      {"speed_limit_mps", [&](RoadMap* map) { map->lanes[0].speed_limit_mps = nan; }},
      {"length_m", [](RoadMap* map) { map->lanes[0].length_m = 0; }},
      {"in return",
       [&](RoadMap* map) {
         map->lane_links[static_cast<std::size_t>(map->lanes[linked].successors.begin)] = static_cast<int32_t>(linked);
       }},
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
  };
  for (const auto& [expected, damage] : damages) {
    RoadMap map = sound;
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
    const char* before = std::getenv("PICTURA_DATA");
    before_ = before ? before : "";
    folder_ = std::filesystem::temp_directory_path() / fmt::format("pictura_load_map_{}", ::getpid());
    std::filesystem::create_directories(folder_ / "carla");
    std::ofstream(folder_ / "Here.xodr") << "<OpenDRIVE><road id=\"1\" ";
    std::ofstream(folder_ / "carla" / "There.xodr") << "<OpenDRIVE/>";
    std::ofstream(folder_ / "picture.png") << "png";
    ::setenv("PICTURA_DATA", folder_.c_str(), 1);
  }
  void TearDown() override {
    ::setenv("PICTURA_DATA", before_.c_str(), 1);
    std::filesystem::remove_all(folder_);
  }
  std::string message_of(const std::string& name) {
    try {
      load_map(name);
    } catch (const Error& error) {
      return error.what();
    }
    return "(no error)";
  }
  std::filesystem::path folder_;
  std::string before_;
};

TEST_F(LoadMapFiles, UnknownNamesListWhatThereIs) {
  EXPECT_THROW(load_map("Nowhere"), UsageError);
  EXPECT_THAT(message_of("Nowhere"), HasSubstr("Here, There"));
  EXPECT_THAT(message_of("Nowhere"), HasSubstr("procedural"));
  EXPECT_THROW(load_map(""), UsageError);
  EXPECT_THROW(load_map("../Here"), UsageError);
  EXPECT_THROW(load_map((folder_ / "picture.png").string()), UsageError);
  EXPECT_THROW(load_map(folder_.string()), UsageError);
}

TEST_F(LoadMapFiles, BadFilesAreNamed) {
  EXPECT_THAT(message_of("Here"), HasSubstr("Here.xodr:1"));
  EXPECT_THAT(message_of("There"), HasSubstr("There.xodr"));
  EXPECT_THAT(message_of((folder_ / "missing.xodr").string()), HasSubstr("missing.xodr"));
}

}  // namespace
}  // namespace pictura
