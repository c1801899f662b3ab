// Small files like those that other tools write, and the table of these files in docs/research/map_cases.md.
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "pictura/common/support/file.h"
#include "pictura/map/open_lanes.h"
#include "pictura/map/opendrive/opendrive.h"
#include "pictura/map/repairs.h"

namespace pictura {
namespace {

struct MapCase {
  std::string name;  // name of the file, without .xodr
  std::string kind;  // contents of the file
};

const std::vector<MapCase> kCases{
    {"center_lane_without_type", "center lanes without a type"},
    {"road_mark_width_minus_one", "road marks of width -1, which some tools write for none"},
    {"tiny_road_elevation", "a road of 0.2 nm with a steep slope"},
    {"geometry_of_no_length", "a road and a geometry of no length"},
    {"tiny_section_lane_offset", "a lane section of 20 micrometres where the lane offset jumps"},
    {"jump_in_reference_line", "a reference line that jumps 0.63 m sideways"},
    {"elevation_steps", "steps of the elevation, 2 m up and 0.8 m down"},
    {"steep_street", "a street with a grade of 70 %"},
    {"light_without_controller", "a traffic light without a controller, away from junctions"},
    {"street_with_ends", "a street whose ends lead nowhere"},
    {"cul_de_sac", "a street that ends in a turning circle"},
    {"garage", "a ramp of 10 % up to a deck with parking spaces"},
    {"highway_exit", "a piece of a highway with an exit lane and its ramp"},
    {"turnaround", "a turnaround whose inner lane folds over itself"},
    {"lane_change_in_short_sections", "lane changes within sections of a few metres"},
    {"through_lane_two_changes_away", "a route that continues two lanes away"},
    {"utm_loop", "coordinates of a UTM zone, 5,800 km from its origin"},
};

TEST(OpenDriveCases, ThePageListsTheResultOfEachFile) {
  std::string table = "| file | what it has | lanes | endless, open | what is done |\n|---|---|---|---|---|\n";
  for (const MapCase& its : kCases) {
    const std::string file = its.name + ".xodr";
    const RoadMap map = parse_opendrive(read_file(PICTURA_MAP_CASES "/" + file), file);
    const LaneUse use = count_lane_use(map);
    std::string done;
    for (const RepairGroup& group : group_repairs(map.mends)) {
      done += fmt::format("{}{}: {}", done.empty() ? "" : "; ", to_string(group.kind), action_of(group.kind));
    }
    table += fmt::format("| `{0}` | {1} | {2}, {3:.3f} km | {4}, {5} | {6} |\n", its.name, its.kind, map.facts.lanes,
                         map.facts.driving_lane_km, use.endless, use.open, done.empty() ? "accepted" : done);
  }
  const std::string docs = read_file(PICTURA_MAP_CASES_DOCS);
  EXPECT_TRUE(docs.find(table) != std::string::npos) << "expected in docs/research/map_cases.md:\n" << table;
}

}  // namespace
}  // namespace pictura
