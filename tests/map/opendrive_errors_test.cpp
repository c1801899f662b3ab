// Malformed OpenDRIVE files give an Error with source, line, road and element. Strict reading reports all faults.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/common/error.h"
#include "pictura/map/opendrive/opendrive.h"
#include "pictura/tests/map/small_roads.h"
#include "pictura/tests/support/error_message.h"

namespace pictura {
namespace {

using test::file_of;
using test::lane_of;
using test::line_at;
using test::replaced;
using test::RoadText;
using ::testing::AllOf;
using ::testing::HasSubstr;

std::string message_of(const std::string& text) {
  return test::message_of([&] { parse_opendrive(text, "bad.xodr", {.strict = true}); });
}

std::string good_file() {
  RoadText road;
  road.right = lane_of(-1, "driving", 3);
  return file_of(road.text());
}

TEST(OpenDriveErrors, TheUnchangedFileIsValid) { EXPECT_EQ(message_of(good_file()), test::kNoError); }

TEST(OpenDriveErrors, OtherFormatsAreRejected) {
  EXPECT_THAT(message_of(""), HasSubstr("bad.xodr"));
  EXPECT_THAT(message_of("P6 640 480 255"), HasSubstr("bad.xodr"));
  EXPECT_THAT(message_of("<svg/>"), AllOf(HasSubstr("expected OpenDRIVE"), HasSubstr("<svg>")));
  EXPECT_THAT(message_of("<OpenDRIVE/>"), HasSubstr("<road>"));
}

TEST(OpenDriveErrors, EveryTruncationIsRejected) {
  const std::string text = good_file();
  for (std::size_t length = 0; length + 14 < text.size(); ++length) {
    EXPECT_NE(message_of(text.substr(0, length)), test::kNoError) << length;
  }
}

TEST(OpenDriveErrors, AttributesAreCheckedAndNamedWithTheirLine) {
  const std::string text = good_file();
  // <geometry> is on the seventh line: after three lines of file header, <road>, <link> and <planView>.
  for (const auto& [from, to, expected] : std::vector<std::array<std::string, 3>>{
           {"x=\"0\"", "x=\"nan\"", "bad.xodr:7: road 1: <geometry>: attribute x: expected a finite number, got 'nan'"},
           {"x=\"0\"", "x=\"inf\"", "attribute x"},
           {"x=\"0\"", "x=\"12abc\"", "attribute x: expected a finite number, got '12abc'"},
           {"x=\"0\"", "", "attribute x is missing"},
           {"length=\"100\"><line/>", "length=\"0\"><line/>", "bad.xodr:4: road 1: <road>: attribute length"},
           {"length=\"100\"><line/>", "length=\"-5\"><line/>", "attribute length: expected a number in"},
           {"length=\"100\"><line/>", "length=\"50\"><line/>", "ends at 50"},
           {"length=\"100\" junction", "length=\"-100\" junction", "bad.xodr:4: road 1: <road>: attribute length"},
           {"length=\"100\" junction", "length=\"1e9\" junction", "attribute length: expected a number in"},
           {"<line/>", "<arc/>", "<arc>: attribute curvature is missing"},
           {"<line/>", "<arc curvature=\"1e9\"/>", "expected a curve of at most"},
           {"<line/>", "<paramPoly3/>", "<paramPoly3>: attribute aU is missing"},
           {"<line/>", "", "expected a <line>, <arc>, <spiral>, <poly3> or <paramPoly3>"},
           {"id=\"-1\"", "id=\"one\"", "attribute id: expected an integer within 1000000000 of 0, got 'one'"},
           {"id=\"-1\"", "id=\"1\"", "does not belong in <right>"},
           {"id=\"-1\"", "id=\"-2\"", "expected -1"},
           {"id=\"-1\"", "id=\"-2147483648\"", "expected an integer within 1000000000 of 0"},
           {"length=\"100\" junction", "length=\"1e-4\" junction", "ends at 100; expected the road's length, 0.0001"},
           {"id=\"0\"", "id=\"3\"", "expected 0 for the center lane, got 3"},
           {"type=\"driving\"", "type=\"flying\"", "'flying' is not a lane type"},
           {"a=\"3\"", "a=\"-3\"", "road 1: <lane>: its width at s 0.000 is -3.000 m; expected at least 0"},
           {"a=\"3\"", "a=\"3\" e=\"0\" x=\"", "bad.xodr"},
           {"b=\"0\"", "b=\"-1\"", "its width at s"},
           {"b=\"0\"", "b=\"1e200\"", "expected at most"},
           {"b=\"0\"", "b=\"9\"", "its width at s 75.000 is 678.000 m; expected at most 500"},
           {"junction=\"-1\"", "junction=\"5\"", "belongs to junction 5, which does not exist"},
           {"junction=\"-1\"", "junction=\"-1\" rule=\"XHT\"", "attribute rule: expected RHT or LHT, got 'XHT'"},
           {"<link></link>", "<link><successor elementType=\"road\" elementId=\"9\" contactPoint=\"start\"/></link>",
            "bad.xodr:5: road 1: <successor>: refers to road 9, which does not exist"},
           {"<link></link>", "<link><successor elementType=\"junction\" elementId=\"9\"/></link>",
            "refers to junction 9, which does not exist"},
           {"<link></link>", "<link><successor elementType=\"road\" elementId=\"1\"/></link>",
            "contactPoint is missing"},
           {"<laneSection s=\"0\">", "<laneSection s=\"5\">", "expected the first section at 0"},
           {"<lanes>",
            "<lateralProfile><superelevation s=\"0\" a=\"1.5\" b=\"0\" c=\"0\" d=\"0\"/></lateralProfile><lanes>",
            "it is banked by 1.5 rad; expected at most 1.4"},
           {"<lanes>", "<lanes><laneOffset s=\"0\" a=\"1e300\" b=\"0\" c=\"0\" d=\"0\"/>", "to its side"},
       }) {
    EXPECT_THAT(message_of(replaced(text, from, to)), HasSubstr(expected)) << from << " -> " << to;
  }
}

TEST(OpenDriveErrors, GapsBetweenGeometriesAreMeasured) {
  RoadText road;
  road.right = lane_of(-1, "driving", 3);
  road.geometry = line_at(0, 0, 0, 0, 50) + line_at(50, 50.5, 0, 0, 50);
  EXPECT_THAT(message_of(file_of(road.text())), AllOf(HasSubstr("bad.xodr:8"), HasSubstr("begins 0.500 m from")));
  road.geometry = line_at(0, 0, 0, 0, 50) + line_at(49, 50, 0, 0, 51);
  EXPECT_THAT(message_of(file_of(road.text())), HasSubstr("expected 50"));
  road.geometry = line_at(0, 0, 0, 0, 50) + line_at(50, 50.001, 0, 0, 50);
  EXPECT_EQ(message_of(file_of(road.text())), test::kNoError);
}

TEST(OpenDriveErrors, IdsAreUnique) {
  RoadText road;
  road.right = lane_of(-1, "driving", 3);
  EXPECT_THAT(message_of(file_of(road.text() + road.text())), HasSubstr("road 1: <road>: attribute id: another road"));
  EXPECT_THAT(message_of(file_of(road.text() + "<junction id=\"1\"/><junction id=\"1\"/>")),
              HasSubstr("another junction"));
  road.rest = R"(<signals><signal id="5" s="0" t="0"/><signal id="5" s="1" t="0"/></signals>)";
  EXPECT_THAT(message_of(file_of(road.text())), HasSubstr("another signal already has 5"));
}

TEST(OpenDriveErrors, LinksMustHaveATarget) {
  RoadText road;
  road.link = R"(<predecessor elementType="road" elementId="1" contactPoint="end"/>)"
              R"(<successor elementType="road" elementId="1" contactPoint="start"/>)";
  road.right = lane_of(-1, "driving", 3, R"(<link><successor id="-4"/></link>)");
  EXPECT_THAT(message_of(file_of(road.text())), HasSubstr("is linked to lane -4 of road 1, which does not exist"));
  road.right = lane_of(-1, "driving", 3);
  for (const auto& [connection, expected] : std::vector<std::array<std::string, 2>>{
           {R"(incomingRoad="1" connectingRoad="8" contactPoint="start")", "refers to road 8"},
           {R"(incomingRoad="8" connectingRoad="1" contactPoint="start")", "refers to road 8"},
           {R"(incomingRoad="1" connectingRoad="1" contactPoint="middle")", "expected start or end, got 'middle'"}}) {
    EXPECT_THAT(
        message_of(file_of(road.text() + "<junction id=\"3\"><connection id=\"0\" " + connection + "/></junction>")),
        HasSubstr(expected));
  }
  road.rest = R"(<signals><signalReference id="77" s="0" t="0"/></signals>)";
  EXPECT_THAT(message_of(file_of(road.text())), HasSubstr("refers to signal 77, which does not exist"));
  road.rest = "";
  EXPECT_THAT(message_of(file_of(road.text() + "<controller id=\"4\"><control signalId=\"6\"/></controller>")),
              HasSubstr("controller 4: <controller>: controls signal 6"));
}

TEST(OpenDriveErrors, ContradictoryRoadLinksAreRejected) {
  auto link = [](const char* end, const char* road, const char* contact) {
    return fmt::format(R"(<{} elementType="road" elementId="{}" contactPoint="{}"/>)", end, road, contact);
  };
  RoadText a, b, c;
  for (RoadText* road : {&a, &b, &c}) road->right = lane_of(-1, "driving", 3);
  b.id = "2";
  b.geometry = line_at(0, 100, 0, 0, 100);
  c.id = "3";
  c.geometry = line_at(0, 100, 50, 0, 100);
  // A road that is its own predecessor is a ring; its end must be linked back.
  for (const char* contact : {"start", "end"}) {
    a.link = link("predecessor", "1", contact);
    EXPECT_THAT(message_of(file_of(a.text())),
                HasSubstr(fmt::format("its start is linked to the road's own {}, which is not linked back", contact)));
  }
  a.link = link("predecessor", "1", "end");
  a.link += link("successor", "2", "start");
  EXPECT_THAT(message_of(file_of(a.text() + b.text())),
              HasSubstr("bad.xodr:5: road 1: <predecessor>: the end of road 1 is linked to the start of road 2"));
  // Road 1 continues into 2, whose predecessor in the file is 3.
  a.link = link("successor", "2", "start");
  b.link = link("predecessor", "3", "end");
  EXPECT_THAT(message_of(file_of(a.text() + b.text() + c.text())),
              HasSubstr("road 1: <successor>: the start of road 2 is linked to the end of road 3 instead of the end"));
  b.link = link("predecessor", "1", "end");
  EXPECT_THAT(message_of(file_of(a.text() + b.text() + c.text())),
              HasSubstr("ends 0.00 m from the start of lane -1 of road 2, to which it has no link"));
}

TEST(OpenDriveErrors, SectionsAreInOrder) {
  RoadText road;
  auto section = [](int s) {
    return fmt::format("<laneSection s=\"{}\"><center/><right>{}</right></laneSection>\n", s,
                       lane_of(-1, "driving", 3));
  };
  road.sections = section(0) + section(60) + section(30);
  EXPECT_THAT(message_of(file_of(road.text())),
              AllOf(HasSubstr("<laneSection>: attribute s"), HasSubstr("at least the previous one's 60, got 30")));
  road.sections = section(0) + section(120);
  EXPECT_THAT(message_of(file_of(road.text())), HasSubstr("<laneSection>: attribute s: expected a number in [0, 100]"));
}

TEST(OpenDriveErrors, ErrorsNameUnsupportedFeatures) {
  RoadText road;
  road.right = lane_of(-1, "driving", 3);
  for (const char* type : {"virtual", "crossing"}) {
    EXPECT_THAT(
        message_of(file_of(road.text() + fmt::format("<junction id=\"3\" type=\"{}\"/>", type))),
        HasSubstr(fmt::format("junction 3: <junction>: attribute type: '{}' junctions are not supported", type)));
  }
  road.link = R"(<successor elementType="road" elementId="1" elementS="5" elementDir="+"/>)";
  EXPECT_THAT(message_of(file_of(road.text())), HasSubstr("<successor>: attribute elementS: links to the middle"));
  road.link = "";
  EXPECT_THAT(message_of(file_of("<include file=\"other.xodr\"/>" + road.text())), HasSubstr("bad.xodr:4: <include>"));
  road.rest = R"(<objects><include file="other.xodr"/></objects>)";
  EXPECT_THAT(message_of(file_of(road.text())), HasSubstr("<include>: files of several parts"));
}

TEST(OpenDriveErrors, MaliciousFilesAreRejected) {
  const std::string text = good_file();
  // Entities that expand exponentially.
  EXPECT_THAT(message_of(replaced(text, "<OpenDRIVE>", "<!DOCTYPE a [<!ENTITY b \"&a;&a;\">]><OpenDRIVE>")),
              HasSubstr("bad.xodr:2: a document type (<!DOCTYPE>) is not supported"));
  std::string nul = text;
  nul[text.find("driving")] = '\0';
  EXPECT_THAT(message_of(nul), HasSubstr("bad.xodr:13: expected UTF-8 text, got the byte 0x00"));
  EXPECT_THAT(message_of(replaced(text, "driving", "driv\xffing")), HasSubstr("got the byte 0xff"));
  EXPECT_THAT(message_of(replaced(text, "driving", "\xc3\xa9")), HasSubstr("is not a lane type"));
  std::string nested, closed;
  for (int i = 0; i < 100'000; ++i) {
    nested += "<a>";
    closed += "</a>";
  }
  EXPECT_THAT(message_of(replaced(text, "<header", nested + closed + "<header")), HasSubstr("more than 64 deep"));
  EXPECT_THAT(message_of(replaced(text, "type=\"driving\"", "type=\"" + std::string(1 << 20, 'x') + "\"")),
              HasSubstr("bad.xodr:13: <lane> attribute type: expected at most 4096 bytes, got 1048576"));
}

TEST(OpenDriveErrors, ObjectsAndSignalsAreNearTheirRoad) {
  RoadText road;
  road.right = lane_of(-1, "driving", 3);
  for (
      const auto& [rest, expected] : std::vector<std::array<std::string, 2>>{
          {R"(<objects><object id="1" type="crosswalk" s="500" t="0" length="2" width="2"/></objects>)",
           "<object>: attribute s: expected a number in [-10, 110], got 500"},
          {R"(<objects><object id="1" type="crosswalk" s="5" t="0"/></objects>)", "with an outline, or a length"},
          {R"(<objects><object id="1" type="parking" s="5" t="0" length="5"/></objects>)", "with a length and a width"},
          {R"(<objects><object id="1" type="stopLine" s="5" t="0"/></objects>)", "a stop line at least"},
          {R"(<objects><object id="1" type="crosswalk" s="5" t="0"><outline><cornerLocal u="1" v="0"/></outline></object></objects>)",
           "three distinct corners, got 1"},
          {R"(<signals><signal id="1" s="5" t="1e9"/></signals>)", "<signal>: attribute t: expected a number in"},
          {R"(<objects><object id="1" type="parking" s="5" t="0" length="5" width="2"><repeat s="0" length="100" distance="0.1"/><repeat s="0" length="0.1" distance="1e-7"/></object></objects>)",
           "<repeat>: attribute distance: expected at least 0.1"},
          {R"(<signals><signal id="1" s="5" t="1" orientation="left"/></signals>)",
           "expected +, - or none, got 'left'"}}) {
    road.rest = rest;
    EXPECT_THAT(message_of(file_of(road.text())), HasSubstr(expected)) << rest;
  }
}

// Files of a few kilobytes that once took minutes or gigabytes.
TEST(OpenDriveErrors, RepetitionsInSmallFilesAreBounded) {
  RoadText road;
  road.length = 1e5;
  const auto mark = [](const std::string& offset, double length, double space) {
    return fmt::format(R"(<roadMark sOffset="{}" type="broken" width="0.1"><type name="x" width="0.1">)"
                       R"(<line length="{}" space="{}" tOffset="0" sOffset="0"/></type></roadMark>)",
                       offset, length, space);
  };
  // A number that does not change when one is added.
  road.right = lane_of(-1, "driving", 3, mark("-1e17", 0.04, 0.06));
  EXPECT_THAT(message_of(file_of(road.text())), HasSubstr("attribute sOffset: expected a number in"));
  // Dashes that are too short to be painted.
  road.right = lane_of(-1, "driving", 3, mark("0", 0.001, 0.049));
  EXPECT_THAT(message_of(file_of(road.text())), HasSubstr("its curves need more than"));

  // Sections without length, with every link given twice: links would double with each section.
  RoadText sections;
  for (int i = 0; i < 60; ++i) {
    sections.sections +=
        fmt::format("<laneSection s=\"{}\"><center><lane id=\"0\" type=\"none\"/></center><right>", i * 1e-5) +
        lane_of(-1, "driving", 3,
                R"(<link><predecessor id="-1"/><predecessor id="-1"/>)"
                R"(<successor id="-1"/><successor id="-1"/></link>)") +
        "</right></laneSection>";
  }
  EXPECT_EQ(parse_opendrive(file_of(sections.text()), "short.xodr").lanes.size(), 1u);

  std::string corners;
  for (int i = 0; i < 1000; ++i) corners += fmt::format(R"(<cornerLocal u="{}" v="{}"/>)", i * 0.01, i % 2);
  const auto object = [&](const std::string& type, const std::string& more) {
    RoadText with;
    with.right = lane_of(-1, "driving", 3);
    with.rest =
        fmt::format(R"(<objects><object id="1" type="{}" s="5" t="0">{}<outline>{}</outline></object></objects>)", type,
                    more, corners);
    return file_of(with.text());
  };
  EXPECT_THAT(
      message_of(object("crosswalk",
                        R"(<repeat s="0" length="100" distance="0.1"/><repeat s="0" length="100" distance="0.1"/>)")),
      HasSubstr("copies with at most 1000000 corners in all"));
  EXPECT_THAT(message_of(object("stopLine", "")), HasSubstr("a stop line of at most 64 corners, got"));
}

TEST(OpenDriveErrors, FaultsOfTheWholeNetworkNameTheFile) {
  RoadText near, far;
  near.right = far.right = lane_of(-1, "driving", 3);
  far.id = "2";
  far.geometry = line_at(0, 60'000, 60'000, 0, 100);
  EXPECT_THAT(message_of(file_of(near.text() + far.text())),
              AllOf(testing::StartsWith("bad.xodr: "), HasSubstr("is too large for cells")));
}

TEST(OpenDriveErrors, WindingCurvesUseBoundedMemory) {
  // An elevation cubic that exceeds all limits.
  RoadText road;
  road.length = 1e5;
  road.right = lane_of(-1, "driving", 3);
  road.elevation = R"(<elevation s="0" a="0" b="0" c="0" d="1e-3"/>)";
  EXPECT_THAT(message_of(file_of(road.text())), HasSubstr("expected at most"));
  road.elevation = "";
  const std::string text = file_of(road.text());
  const RoadMap map = parse_opendrive(text, "long.xodr");
  EXPECT_LT(map.lane_points.size(), 20'000u);
  // A lane of 3 km that swings by hundreds of metres.
  road.length = 3e3;
  road.geometry.clear();
  for (int i = 0; i < 30; ++i) {
    road.geometry += line_at(100.0 * i, 100.0 * i, 0, 0, 100);
    road.lane_offset += fmt::format(R"(<laneOffset s="{}" a="0" b="30" c="-0.9" d="0.006"/>)", 100 * i);
  }
  EXPECT_LT(parse_opendrive(file_of(road.text()), "wobble.xodr").lane_points.size(), 100'000u);
}

}  // namespace
}  // namespace pictura
