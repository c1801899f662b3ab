// OpenDRIVE files of roads that end. Ends of two-way roads are exits and entries.
#pragma once

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "pictura/tests/map/small_roads.h"

namespace pictura::test {

/// A street along x with a lane of 3.5 m in each direction.
inline std::string open_street(double length_m = 300) {
  RoadText road;
  road.length = length_m;
  road.left = lane_of(1, "driving", 3.5);
  road.right = lane_of(-1, "driving", 3.5);
  return file_of(road.text());
}

/// A crossing at the origin with four arms of two lanes.
inline std::string open_crossing(double arm_m = 60) {
  constexpr double kArmBegin_m = 12, kQuarter = 1.5707963267948966;
  std::string roads, connections;
  for (int arm = 0; arm < 4; ++arm) {
    const double x = kArmBegin_m * std::cos(kQuarter * arm), y = kArmBegin_m * std::sin(kQuarter * arm);
    RoadText road;
    road.id = std::to_string(arm);
    road.length = arm_m;
    road.geometry = line_at(0, x, y, kQuarter * arm, arm_m);
    road.link = R"(<predecessor elementType="junction" elementId="9"/>)";
    road.left = lane_of(1, "driving", 3.5);
    road.right = lane_of(-1, "driving", 3.5);
    roads += road.text();
    for (int turn = 1; turn < 4; ++turn) {  // right, straight on, left
      const int to = (arm + turn) % 4;
      RoadText way;
      way.id = std::to_string(10 + 4 * arm + turn);
      way.junction = "9";
      way.length = turn == 2 ? 2 * kArmBegin_m : kArmBegin_m * kQuarter;
      way.link = fmt::format(R"(<predecessor elementType="road" elementId="{}" contactPoint="start"/>)"
                             R"(<successor elementType="road" elementId="{}" contactPoint="start"/>)",
                             arm, to);
      way.geometry = fmt::format(
          R"(<geometry s="0" x="{}" y="{}" hdg="{}" length="{}">{}</geometry>)", x, y, kQuarter * (arm + 2), way.length,
          turn == 2 ? "<line/>" : fmt::format(R"(<arc curvature="{}"/>)", (turn - 2) / kArmBegin_m));
      way.right = lane_of(-1, "driving", 3.5, R"(<link><predecessor id="1"/><successor id="-1"/></link>)");
      roads += way.text();
      connections += fmt::format(R"(<connection id="{0}" incomingRoad="{1}" connectingRoad="{0}" contactPoint="start">)"
                                 R"(<laneLink from="1" to="-1"/></connection>)",
                                 way.id, arm);
    }
  }
  return file_of(roads + R"(<junction id="9" name="">)" + connections + "</junction>\n");
}

/// A one-way road of 250 m along x with two lanes, and an on-ramp that ends after 100 m.
inline std::string open_ramp() {
  const auto section = [](double s, const std::string& lanes) {
    return fmt::format(
        R"(<laneSection s="{}"><center><lane id="0" type="none"/></center><right>{}</right></laneSection>)", s, lanes);
  };
  const std::string both = lane_of(-1, "driving", 3.5, R"(<link><predecessor id="-1"/><successor id="-1"/></link>)") +
                           lane_of(-2, "driving", 3.5, R"(<link><predecessor id="-2"/><successor id="-2"/></link>)");
  RoadText road;
  road.length = 250;
  road.sections = section(0, both + lane_of(-3, "onRamp", 3.5)) + section(100, both);
  return file_of(road.text());
}

/// Two roads of one lane along x, with a gap of 0.3 m and no link.
inline std::string unlinked_roads() {
  RoadText first, second;
  first.right = second.right = lane_of(-1, "driving", 3.5);
  second.id = "2";
  second.geometry = line_at(0, 100.3, 0, 0, 100);
  return file_of(first.text() + second.text());
}

/// Returns the sorted paths of tests/map/cases. Callers must define PICTURA_MAP_CASES.
#ifdef PICTURA_MAP_CASES
inline std::vector<std::string> map_cases() {
  std::vector<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(PICTURA_MAP_CASES)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}
#endif

}  // namespace pictura::test
