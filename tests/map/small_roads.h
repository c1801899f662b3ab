// Small OpenDRIVE files for tests.
#pragma once

#include <functional>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "pictura/map/opendrive/opendrive.h"

namespace pictura::test {

inline std::string file_of(const std::string& contents) {
  return "<?xml version=\"1.0\"?>\n<OpenDRIVE>\n<header revMajor=\"1\" revMinor=\"4\"/>\n" + contents +
         "</OpenDRIVE>\n";
}

inline std::string line_at(double s, double x, double y, double heading, double length) {
  return fmt::format(R"(<geometry s="{}" x="{}" y="{}" hdg="{}" length="{}"><line/></geometry>)"
                     "\n",
                     s, x, y, heading, length);
}

/// A lane of constant width. more: further contents of the <lane> element.
inline std::string lane_of(int id, const std::string& type, double width, const std::string& more = "") {
  return fmt::format(R"(<lane id="{}" type="{}">{}<width sOffset="0" a="{}" b="0" c="0" d="0"/></lane>)"
                     "\n",
                     id, type, more, width);
}

struct RoadText {
  std::string id = "1";
  double length = 100;
  std::string junction = "-1";
  std::string link;         // contents of <link>
  std::string type;         // whole <type> elements
  std::string geometry;     // contents of <planView>; empty: a straight line along x
  std::string rule;         // "LHT", or empty
  std::string elevation;    // whole <elevation> elements
  std::string lateral;      // contents of <lateralProfile>
  std::string lane_offset;  // whole <laneOffset> elements
  std::string center_mark;  // whole <roadMark> elements
  std::string left, right;  // whole <lane> elements of the only section
  std::string sections;     // whole <laneSection> elements, instead of `left` and `right`
  std::string rest;         // objects and signals

  std::string text() const {
    std::string lanes = sections;
    if (lanes.empty()) {
      lanes = "<laneSection s=\"0\">\n";
      if (!left.empty()) lanes += "<left>\n" + left + "</left>\n";
      lanes += "<center><lane id=\"0\" type=\"none\">" + center_mark + "</lane></center>\n";
      if (!right.empty()) lanes += "<right>\n" + right + "</right>\n";
      lanes += "</laneSection>\n";
    }
    return fmt::format(
        "<road id=\"{}\" length=\"{}\" junction=\"{}\"{}>\n<link>{}</link>\n{}<planView>\n{}</planView>\n"
        "<elevationProfile>{}</elevationProfile>\n{}<lanes>{}{}</lanes>\n{}</road>\n",
        id, length, junction, rule.empty() ? "" : " rule=\"" + rule + "\"", link, type,
        geometry.empty() ? line_at(0, 0, 0, 0, length) : geometry, elevation,
        lateral.empty() ? "" : "<lateralProfile>" + lateral + "</lateralProfile>\n", lane_offset, lanes, rest);
  }
};

/// Three roads along x: road 1 (with a speed limit) ends at 100 m, road 2 (in junction 7) at 120 m; road 3 follows.
inline std::string three_roads(const std::string& rest_of_2 = "", const std::string& junction_more = "",
                               const std::string& rest_of_1 = "") {
  RoadText a, b, c;
  a.link = R"(<successor elementType="junction" elementId="7"/>)";
  a.type = R"(<type s="0" type="town"><speed max="36" unit="km/h"/></type>)";
  a.right = lane_of(-1, "driving", 3) + lane_of(-2, "driving", 3);
  a.rest = rest_of_1;
  b.id = "2";
  b.junction = "7";
  b.length = 20;
  b.geometry = line_at(0, 100, 0, 0, 20);
  b.link = R"(<predecessor elementType="road" elementId="1" contactPoint="end"/>)"
           R"(<successor elementType="road" elementId="3" contactPoint="start"/>)";
  b.right = lane_of(-1, "driving", 3, R"(<link><predecessor id="-1"/><successor id="-1"/></link>)") +
            lane_of(-2, "driving", 3, R"(<link><predecessor id="-2"/><successor id="-2"/></link>)");
  b.rest = rest_of_2;
  c.id = "3";
  c.link = R"(<predecessor elementType="junction" elementId="7"/>)";
  c.geometry = line_at(0, 120, 0, 0, 100);
  c.right = lane_of(-1, "driving", 3) + lane_of(-2, "driving", 3);
  return a.text() + b.text() + c.text() +
         R"(<junction id="7" name=""><connection id="0" incomingRoad="1" connectingRoad="2" contactPoint="start">)"
         R"(<laneLink from="-1" to="-1"/><laneLink from="-2" to="-2"/></connection>)" +
         junction_more + "</junction>\n";
}

/// A ring of 40 m radius around the origin: two half circles of one lane. road_3: text of a road that links the second
/// to the first half circle.
inline std::string ring_with(const std::string& road_3 = "", const std::function<void(RoadText*)>& change = {}) {
  RoadText half;
  half.length = 40 * std::numbers::pi;
  half.right = lane_of(-1, "driving", 3.5, R"(<link><predecessor id="-1"/><successor id="-1"/></link>)");
  const auto link = [](const std::string& before, const std::string& after) {
    return fmt::format(R"(<predecessor elementType="road" elementId="{}" contactPoint="end"/>)"
                       R"(<successor elementType="road" elementId="{}" contactPoint="start"/>)",
                       before, after);
  };
  const auto arc = [&](double y, double heading) {
    return fmt::format(R"(<geometry s="0" x="0" y="{}" hdg="{}" length="{}"><arc curvature="0.025"/></geometry>)", y,
                       heading, half.length);
  };
  RoadText first = half, second = half;
  first.geometry = arc(-40, 0);
  first.link = link("2", road_3.empty() ? "2" : "3");
  second.id = "2";
  second.geometry = arc(40, std::numbers::pi);
  second.link = link(road_3.empty() ? "1" : "3", "1");
  if (change) change(&first);
  return first.text() + second.text() + road_3;
}

/// Replaces the first occurrence of `from` by `to`.
inline std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  if (at == std::string::npos) throw std::runtime_error("nothing to replace: " + from);
  return text.replace(at, from.size(), to);
}

inline RoadMap parse(const std::string& contents) { return parse_opendrive(file_of(contents), "small.xodr"); }

inline const Lane& lane_named(const RoadMap& map, const std::string& road, int section, int lane) {
  for (const Lane& candidate : map.lanes) {
    if (map.road_names[candidate.source_road] == road && candidate.source_section == section &&
        candidate.source_lane == lane) {
      return candidate;
    }
  }
  throw std::runtime_error(fmt::format("no lane {} in section {} of road {}", lane, section, road));
}

inline int32_t index_of(const RoadMap& map, const Lane& lane) { return static_cast<int32_t>(&lane - map.lanes.data()); }

inline std::vector<int32_t> list(const RoadMap& map, IndexRange range) {
  const Span<const int32_t> links = map.links(range);
  return {links.begin(), links.end()};
}

inline void expect_at(const RoadMap& map, Vec3 p, double x, double y, double z = 0) {
  EXPECT_NEAR(p.x + map.origin_m[0], x, 1e-4);
  EXPECT_NEAR(p.y + map.origin_m[1], y, 1e-4);
  EXPECT_NEAR(p.z + map.origin_m[2], z, 1e-4);
}

}  // namespace pictura::test
