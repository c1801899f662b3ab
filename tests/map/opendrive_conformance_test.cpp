// Small files that each break one of ASAM's rules for OpenDRIVE, and the table of the importer's results in
// docs/reference/opendrive_conformance.md. A rule's id contains the version of the standard in which it was introduced.
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/map/opendrive/opendrive.h"
#include "pictura/map/repairs.h"
#include "pictura/tests/map/small_roads.h"

namespace pictura {
namespace {

using test::file_of;
using test::lane_of;
using test::line_at;
using test::replaced;
using test::RoadText;

struct BrokenRule {
  std::string id;    // without "asam.net:xodr:"
  std::string file;  // kind of the file
  std::string text;
};

RoadText one_lane() {
  RoadText road;
  road.right = lane_of(-1, "driving", 3);
  return road;
}

std::string with_geometry(const std::string& geometry) {
  RoadText road = one_lane();
  road.geometry = geometry;
  return file_of(road.text());
}

/// A straight cubic of 100 m with the given attributes.
std::string cubic(const std::string& attributes) {
  return with_geometry(
      fmt::format(R"(<geometry s="0" x="0" y="0" hdg="0" length="100"><paramPoly3 cU="0" dU="0" aV="0" )"
                  R"(bV="0" cV="0" dV="0" {}/></geometry>)",
                  attributes));
}

std::string section(double s, const std::string& right) {
  return fmt::format(
      R"(<laneSection s="{}"><center><lane id="0" type="none"/></center><right>{}</right></laneSection>)", s, right);
}

std::string linked(int id, double width, const std::string& link) {
  return lane_of(id, "driving", width, "<link>" + link + "</link>");
}

std::string with_sections(const std::string& sections, const std::string& lane_offset = "") {
  RoadText road;
  road.sections = sections;
  road.lane_offset = lane_offset;
  return file_of(road.text());
}

std::string with_lanes(const std::string& left, const std::string& right) {
  RoadText road;
  road.left = left;
  road.right = right;
  return file_of(road.text());
}

std::string width_to_zero(int id, const std::string& link) {
  return fmt::format(
      R"(<lane id="{}" type="driving"><link>{}</link><width sOffset="0" a="3" b="-0.06" c="0" d="0"/></lane>)", id,
      link);
}

/// Road 1 leads to road 2, and so does road 3.
std::string merge_without_junction() {
  RoadText first = one_lane(), second = one_lane(), third = one_lane();
  const char* const to_second = R"(<successor elementType="road" elementId="2" contactPoint="start"/>)";
  first.link = third.link = to_second;
  second.id = "2";
  second.geometry = line_at(0, 100, 0, 0, 100);
  second.link = R"(<predecessor elementType="road" elementId="1" contactPoint="end"/>)";
  third.id = "3";
  return file_of(first.text() + second.text() + third.text());
}

std::vector<BrokenRule> broken_rules() {
  const std::string good = file_of(one_lane().text()), junction = file_of(test::three_roads());
  const std::string next = R"(<successor id="-1"/>)", before = R"(<predecessor id="-1"/>)";
  const std::string connection = R"(connectingRoad="2" contactPoint="start")";
  return {
      {"1.0.0:xml.valid_xml_document", "ends in the middle", good.substr(0, good.size() / 2)},
      {"1.0.0:xml.root_tag_is_opendrive", "has another root", "<Roads/>"},
      {"1.0.0:xml.fileheader_is_present", "no header", "<OpenDRIVE>" + one_lane().text() + "</OpenDRIVE>"},
      {"1.0.0:xml.version_is_defined", "a header without a version",
       replaced(good, R"(<header revMajor="1" revMinor="4"/>)", "<header/>")},
      {"1.0.0:xml.valid_schema", "a road without planView",
       replaced(replaced(good, "<planView>", "<plan>"), "</planView>", "</plan>")},
      {"1.4.0:road.geometry.elem_asc_order", "the second geometry first",
       with_geometry(line_at(50, 50, 0, 0, 50) + line_at(0, 0, 0, 0, 50))},
      {"1.7.0:road.geometry.contact_point", "a geometry 0.63 m beside the end of the one before",
       with_geometry(line_at(0, 0, 0, 0, 50) + line_at(50, 50, 0.63, 0, 50))},
      {"1.7.0:road.geometry.one_geom_elem_per_spec", "a geometry that is a line and an arc",
       replaced(good, "<line/>", R"(<line/><arc curvature="0.1"/>)")},
      {"1.7.0:road.geometry.paramPoly3.valid_parameters", "a curve with aU 1",
       cubic(R"(pRange="normalized" aU="1" bU="100")")},
      {"1.7.0:road.geometry.parampoly3.arclength_range", "pRange arcLength, but parameters from 0 to 1",
       cubic(R"(pRange="arcLength" aU="0" bU="100")")},
      {"1.7.0:road.geometry.parampoly3.normalized_range", "pRange normalized, but parameters from 0 to the length",
       cubic(R"(pRange="normalized" aU="0" bU="1")")},
      {"1.7.0:road.geometry.parampoly3.length_match", "a curve of 40 m for 100 m",
       cubic(R"(pRange="normalized" aU="0" bU="40")")},
      {"1.4.0:road.lane.border.overlap_with_inner_lanes", "a border 1 m inside the inner lane",
       with_lanes("", lane_of(-1, "driving", 3) +
                          R"(<lane id="-2" type="driving"><border sOffset="0" a="-2" b="0" c="0" d="0"/></lane>)")},
      {"1.4.0:road.lane.link.lanes_across_lane_sections", "lanes of two sections without links",
       with_sections(section(0, lane_of(-1, "driving", 3)) + section(50, lane_of(-1, "driving", 3)))},
      {"1.4.0:road.lane.link.new_lane_appear", "a new lane linked to the one beside it",
       with_sections(section(0, linked(-1, 3, next)) + section(50, linked(-1, 3, before) + linked(-2, 3, before)))},
      {"1.7.0:road.lane.link.zero_width_at_end", "a lane of width 0 at its end, with a successor",
       with_sections(section(0, width_to_zero(-1, next)) + section(50, linked(-1, 3, before)))},
      {"1.7.0:road.lane.link.zero_width_at_start", "a lane of no width with a predecessor",
       with_sections(section(0, linked(-1, 3, next)) + section(50, linked(-1, 0, before)))},
      {"1.7.0:road.lane.level_true_one_side", "a level lane whose outer neighbour is not level",
       with_lanes("",
                  replaced(lane_of(-1, "driving", 3), "type", R"(level="true" type)") + lane_of(-2, "sidewalk", 2))},
      {"1.7.0:road.lane.access.no_mix_of_deny_or_allow", "access denied and allowed",
       with_lanes("", lane_of(-1, "driving", 3,
                              R"(<access sOffset="0" rule="deny" restriction="truck"/>)"
                              R"(<access sOffset="0" rule="allow" restriction="bus"/>)"))},
      {"1.7.0:lane_smoothness.contact_point_no_horizontal_gaps", "a lane 2 m beside the one that it continues",
       with_sections(section(0, linked(-1, 3, next)) + section(50, linked(-1, 3, before)),
                     R"(<laneOffset s="0" a="0" b="0" c="0" d="0"/><laneOffset s="50" a="2" b="0" c="0" d="0"/>)")},
      {"1.7.0:performance.avoid_redundant_info", "the same width twice",
       with_lanes("", lane_of(-1, "driving", 3, R"(<width sOffset="0" a="3" b="0" c="0" d="0"/>)"))},
      {"1.4.0:road.linkage.is_junction_needed", "two roads that lead to a third without a junction",
       merge_without_junction()},
      {"1.4.0:junctions.connection.connect_road_no_incoming_road", "a connection from a connecting road",
       replaced(junction, R"(incomingRoad="1")", R"(incomingRoad="2")")},
      {"1.7.0:junctions.connection.start_along_linkage", "the wrong end of a connecting road",
       replaced(junction, connection, R"(connectingRoad="2" contactPoint="end")")},
      {"1.7.0:junctions.connection.one_connection_element", "a connection twice",
       file_of(test::three_roads("", R"(<connection id="1" incomingRoad="1" connectingRoad="2" contactPoint="start">)"
                                     R"(<laneLink from="-1" to="-1"/></connection>)"))},
      {"1.8.0:junctions.connection.one_link_to_incoming", "a lane link twice",
       replaced(junction, R"(<laneLink from="-1" to="-1"/>)",
                R"(<laneLink from="-1" to="-1"/><laneLink from="-1" to="-1"/>)")},
  };
}

/// Result of importing a file, as a cell of the table.
std::string made_of(const std::string& text) {
  try {
    const RoadMap map = parse_opendrive(text, "FILE");
    if (map.mends.empty()) return "accepted";
    std::string made;
    for (const RepairGroup& group : group_repairs(map.mends)) {
      made += fmt::format("{}{}: {}", made.empty() ? "" : "; ", to_string(group.kind), action_of(group.kind));
    }
    return made;
  } catch (const Error& error) {
    return fmt::format("refused: `{}`", error.what());
  }
}

TEST(OpenDriveConformance, TheTableListsTheHandlingOfEachRuleViolation) {
  std::string table = "| rule | file | what is done |\n|---|---|---|\n";
  for (const BrokenRule& rule : broken_rules()) {
    table += fmt::format("| {} | {} | {} |\n", rule.id, rule.file, made_of(rule.text));
  }
  const std::string docs = read_file(PICTURA_OPENDRIVE_DOCS);
  EXPECT_TRUE(docs.find(table) != std::string::npos) << "expected in docs/reference/opendrive_conformance.md:\n"
                                                     << table;
}

}  // namespace
}  // namespace pictura
