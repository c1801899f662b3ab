// Small OpenDRIVE files for tests, put together from text.
#pragma once

#include <string>

#include <fmt/format.h>

namespace pictura::test {

/// A file with the given contents of <OpenDRIVE>.
inline std::string file_of(const std::string& contents) {
  return "<?xml version=\"1.0\"?>\n<OpenDRIVE>\n<header revMajor=\"1\" revMinor=\"4\"/>\n" + contents +
         "</OpenDRIVE>\n";
}

inline std::string line_at(double s, double x, double y, double heading, double length) {
  return fmt::format(R"(<geometry s="{}" x="{}" y="{}" hdg="{}" length="{}"><line/></geometry>)"
                     "\n",
                     s, x, y, heading, length);
}

/// A lane with a constant width; `more` goes into the element.
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
  std::string elevation;    // whole <elevation> elements
  std::string lane_offset;  // whole <laneOffset> elements
  std::string center_mark;  // whole <roadMark> elements
  std::string left, right;  // whole <lane> elements of the one section
  std::string sections;     // instead: whole <laneSection> elements
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
        "<road id=\"{}\" length=\"{}\" junction=\"{}\">\n<link>{}</link>\n{}<planView>\n{}</planView>\n"
        "<elevationProfile>{}</elevationProfile>\n<lanes>{}{}</lanes>\n{}</road>\n",
        id, length, junction, link, type, geometry.empty() ? line_at(0, 0, 0, 0, length) : geometry, elevation,
        lane_offset, lanes, rest);
  }
};

}  // namespace pictura::test
