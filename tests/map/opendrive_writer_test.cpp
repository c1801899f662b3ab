// Networks written as text: what is read again is what was written, and what is written again is the same text.
#include <filesystem>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/common/error.h"
#include "pictura/common/file.h"
#include "pictura/map/load_map.h"
#include "pictura/map/map_fields.h"
#include "pictura/map/opendrive/opendrive.h"
#include "pictura/map/opendrive/writer.h"
#include "pictura/map/procedural/procedural_town.h"

namespace pictura {
namespace {

/// Exports twice: the second export changes no byte, and the map of the export is the map of the original.
void check_round_trip(const std::string& text, const std::string& name) {
  const std::string once = export_opendrive(text, name);
  ASSERT_EQ(export_opendrive(once, name), once);
  RoadMap original = parse_opendrive(text, name), exported = parse_opendrive(once, name);
  // Elements stand on other lines of the export, and sections shorter than a millimetre, which the reader bridges, are
  // not in it.
  for (RoadMap* map : {&original, &exported}) {
    map->provenance = {};
    for (Lane& lane : map->lanes) lane.source_section = 0;
  }
  EXPECT_EQ(first_difference(original, exported), "");
}

class CarlaExport : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Towns, CarlaExport,
                         testing::Values("Town01", "Town02", "Town03", "Town04", "Town05", "Town06", "Town07",
                                         "Town10HD"));

TEST_P(CarlaExport, KeepsTheMapAndThenEveryByte) {
  const std::string path = map_folder() + "/carla/" + GetParam() + ".xodr";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not there";
  check_round_trip(read_file(path), path);
}

TEST(OpenDriveExport, OfProceduralTownsKeepsEverythingAtOnce) {
  for (uint64_t seed = 0; seed < 20; ++seed) {
    TownOptions options;
    options.seed = seed;
    const std::string text = procedural_town(options);
    ASSERT_EQ(export_opendrive(text, "town"), text) << "seed " << seed;
  }
}

}  // namespace
}  // namespace pictura
