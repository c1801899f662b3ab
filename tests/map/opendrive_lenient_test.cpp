// Lenient reading: faulty parts are skipped with a warning each, and the rest is a valid map.
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/common/error.h"
#include "pictura/map/opendrive/opendrive.h"
#include "pictura/tests/map/small_roads.h"

namespace pictura {
namespace {

using test::file_of;
using test::lane_of;
using test::line_at;
using test::RoadText;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

struct LenientMap {
  RoadMap map;
  std::vector<std::string> warnings;
};

LenientMap read_leniently(const std::string& text) {
  LenientMap result;
  result.map = parse_opendrive(text, "bad.xodr", {.lenient = true}, &result.warnings);
  return result;
}

/// Two consecutive roads with elements of several kinds.
RoadText first_road() {
  RoadText road;
  road.link = R"(<successor elementType="road" elementId="2" contactPoint="start"/>)";
  road.center_mark = R"(<roadMark sOffset="0" type="solid" color="white"/>)";
  road.right = lane_of(-1, "driving", 3, R"(<link><successor id="-1"/></link>)") + lane_of(-2, "sidewalk", 2);
  road.rest = R"(<objects><object id="1" type="crosswalk" s="10" t="0" length="2" width="6"/></objects>)"
              R"(<signals><signal id="4" type="206" s="90" t="-4"/><signalReference id="4" s="5" t="0"/></signals>)";
  return road;
}

RoadText second_road() {
  RoadText road;
  road.id = "2";
  road.geometry = line_at(0, 100, 0, 0, 100);
  road.right = lane_of(-1, "driving", 3);
  return road;
}

std::string good_file() { return file_of(first_road().text() + second_road().text()); }

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  if (at == std::string::npos) throw std::runtime_error("nothing to replace: " + from);
  return text.replace(at, from.size(), to);
}

TEST(OpenDriveLenient, AValidFileGivesNoWarning) {
  const LenientMap read = read_leniently(good_file());
  EXPECT_THAT(read.warnings, IsEmpty());
  EXPECT_EQ(read.map.lanes.size(), 3u);
}

TEST(OpenDriveLenient, TheSmallestFaultyPartIsSkipped) {
  struct Case {
    const char *from, *to, *warning;
    std::size_t lanes, markings, crosswalks, signs, links;
  };
  for (const Case& c : std::vector<Case>{
           {"type=\"solid\"", "type=\"wavy\"", "road 1: <roadMark>: attribute type", 3, 0, 1, 1, 2},
           {"s=\"10\" t=\"0\"", "s=\"nan\" t=\"0\"", "road 1: <object>: attribute s", 3, 1, 0, 1, 2},
           {"width=\"6\"", "", "road 1: <object>: expected a crosswalk", 3, 1, 0, 1, 2},
           {"s=\"90\" t=\"-4\"", "s=\"90\"", "road 1: <signal>: attribute t is missing", 3, 1, 1, 0, 2},
           {"signalReference id=\"4\"", "signalReference id=\"5\"", "<signalReference>: refers to signal 5", 3, 1, 1, 1,
            2},
           {"<successor id=\"-1\"/>", "<successor id=\"-7\"/>", "is linked to lane -7 of road 2", 3, 1, 1, 1, 0},
           {"<successor id=\"-1\"/>", "<successor id=\"x\"/>", "<successor>: attribute id: expected an integer", 3, 1,
            1, 1, 0},
           {"elementId=\"2\"", "elementId=\"9\"", "refers to road 9", 3, 1, 1, 1, 0},
           {"type=\"sidewalk\"", "type=\"canal\"", "road 1: <lane>: attribute type: 'canal'", 2, 1, 1, 1, 2},
           {"a=\"2\" b=\"0\"", "a=\"2\" b=\"-1\"", "road 1: <lane>: its width at s", 2, 1, 1, 1, 2},
           {"x=\"100\"", "x=\"inf\"", "road 2: <geometry>: attribute x", 2, 1, 1, 1, 0},
           {"road id=\"2\"", "road id=\"1\"", "road 1: <road>: attribute id: another road has it", 2, 1, 1, 1, 0}}) {
    const LenientMap read = read_leniently(replaced(good_file(), c.from, c.to));
    ASSERT_FALSE(read.warnings.empty()) << c.to;
    EXPECT_THAT(read.warnings[0], HasSubstr(c.warning));
    EXPECT_THAT(read.warnings[0], HasSubstr("bad.xodr:"));
    EXPECT_EQ(read.map.lanes.size(), c.lanes) << c.to;
    EXPECT_EQ(read.map.markings.size(), c.markings) << c.to;
    EXPECT_EQ(read.map.crosswalks.size(), c.crosswalks) << c.to;
    EXPECT_EQ(read.map.signs.size(), c.signs) << c.to;
    EXPECT_EQ(read.map.lane_links.size(), c.links) << c.to;
    EXPECT_THROW(parse_opendrive(replaced(good_file(), c.from, c.to), "bad.xodr"), Error) << c.to;
  }
}

TEST(OpenDriveLenient, JunctionsOfUnknownKindsConnectNothing) {
  RoadText road = second_road();
  road.link = R"(<successor elementType="junction" elementId="3"/>)";
  const LenientMap read =
      read_leniently(file_of(road.text() + R"(<junction id="3" type="virtual" mainRoad="2" sStart="1" sEnd="2"/>)"));
  EXPECT_THAT(read.warnings, ElementsAre(HasSubstr("'virtual' junctions are not supported")));
  EXPECT_EQ(read.map.junctions.size(), 1u);
}

TEST(OpenDriveLenient, ManyFaultsAreCountedRatherThanListed) {
  RoadText road = second_road();
  for (int i = 0; i < 10'050; ++i) road.center_mark += "<roadMark/>";
  const LenientMap read = read_leniently(file_of(road.text()));
  ASSERT_EQ(read.warnings.size(), 10'001u);
  EXPECT_EQ(read.warnings.back(), "and 50 more");
}

TEST(OpenDriveLenient, FaultsThatLeaveNoMapAreErrors) {
  EXPECT_THROW(read_leniently(""), Error);
  EXPECT_THROW(read_leniently("<OpenDRIVE/>"), Error);
  EXPECT_THROW(read_leniently(replaced(file_of(second_road().text()), "x=\"100\"", "x=\"inf\"")), Error);
}

TEST(OpenDriveLenient, DamagedFilesGiveAValidMapOrAnError) {
  // parse_opendrive validates its result; anything but a map or an Error ends the test.
  const std::string valid_text = good_file();
  std::mt19937 random(7);
  const std::string alphabet = "0123456789-.e\"<>/= abcxyz";
  int maps = 0;
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
      read_leniently(text);
      ++maps;
    } catch (const Error&) {
    }
  }
  EXPECT_GT(maps, 300);
}

}  // namespace
}  // namespace pictura
