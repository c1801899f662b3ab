#include "pictura/tests/map/opendrive_text.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

#include <fmt/format.h>

namespace pictura::test {

namespace {

double number(const pugi::xml_node& node, const char* attribute) { return node.attribute(attribute).as_double(); }

struct ValueAndSlope {
  double value = 0, slope = 0;
};

ValueAndSlope cubic_at(const pugi::xml_node& parent, const char* name, const char* station, double s) {
  ValueAndSlope at;
  for (const pugi::xml_node& piece : parent.children(name)) {
    const double ds = s - number(piece, station);
    if (ds < 0) break;
    const double b = number(piece, "b"), c = number(piece, "c"), d = number(piece, "d");
    at = {number(piece, "a") + ds * (b + ds * (c + ds * d)), b + ds * (2 * c + ds * 3 * d)};
  }
  return at;
}

pugi::xml_node end_section(const pugi::xml_node& road, bool at_start) {
  const pugi::xml_node lanes = road.child("lanes");
  if (at_start) return lanes.child("laneSection");
  pugi::xml_node last;
  for (const pugi::xml_node& section : lanes.children("laneSection")) last = section;
  return last;
}

class RuleChecker {
 public:
  explicit RuleChecker(const OpenDriveText& text) : text_(text), root_(text.root()) {}

  std::vector<std::string> check() {
    const pugi::xml_node header = root_.child("header");
    expect(header && is(header, "revMajor", "1") && header.attribute("revMinor"), "header");
    unique("road", root_.children("road"), "id");
    unique("junction", root_.children("junction"), "id");
    unique("controller", root_.children("controller"), "id");
    std::set<std::string> signals, objects;
    for (const pugi::xml_node& road : root_.children("road")) {
      check_road(road);
      for (const pugi::xml_node& signal : road.child("signals").children("signal")) {
        requires_attributes(signal, {"s", "t", "id", "dynamic", "orientation", "zOffset", "type", "subtype"});
        in_range(signal, "s", 0, number(road, "length"));
        expect(signals.insert(signal.attribute("id").value()).second, "signal id twice");
      }
      for (const pugi::xml_node& object : road.child("objects").children("object")) {
        requires_attributes(object, {"id", "s", "t", "zOffset", "type"});
        in_range(object, "s", 0, number(road, "length"));
        expect(objects.insert(object.attribute("id").value()).second, "object id twice");
      }
    }
    for (const pugi::xml_node& road : root_.children("road")) {
      for (const pugi::xml_node& reference : road.child("signals").children("signalReference")) {
        requires_attributes(reference, {"s", "t", "id", "orientation"});
        expect(signals.contains(reference.attribute("id").value()), "reference to no signal");
      }
    }
    std::set<std::string> controllers;
    for (const pugi::xml_node& controller : root_.children("controller")) {
      controllers.insert(controller.attribute("id").value());
      for (const pugi::xml_node& control : controller.children("control")) {
        expect(signals.contains(control.attribute("signalId").value()), "control of no signal");
      }
    }
    for (const pugi::xml_node& junction : root_.children("junction")) {
      check_junction(junction);
      for (const pugi::xml_node& controller : junction.children("controller")) {
        expect(controllers.contains(controller.attribute("id").value()), "junction's controller does not exist");
      }
    }
    return violations_;
  }

 private:
  void expect(bool holds, const std::string& what) {
    if (!holds) violations_.push_back(owner_ + ": " + what);
  }
  void requires_attributes(const pugi::xml_node& node, std::initializer_list<const char*> attributes) {
    for (const char* attribute : attributes) {
      expect(!node.attribute(attribute).empty(), fmt::format("<{}> without {}", node.name(), attribute));
    }
  }
  void in_range(const pugi::xml_node& node, const char* attribute, double low, double high) {
    const double value = number(node, attribute);
    expect(value >= low - 1e-6 && value <= high + 1e-6, fmt::format("<{}> {} = {}", node.name(), attribute, value));
  }
  template <typename Nodes>
  void unique(const char* what, const Nodes& nodes, const char* attribute) {
    std::set<std::string> seen;
    for (const pugi::xml_node& node : nodes) {
      requires_attributes(node, {attribute});
      expect(seen.insert(node.attribute(attribute).value()).second, fmt::format("{} {} twice", what, attribute));
    }
  }
  /// Checks that stations ascend from 0 within [0, length].
  void ascends(const pugi::xml_node& parent, const char* name, const char* station, double length) {
    double before = -1;
    for (const pugi::xml_node& node : parent.children(name)) {
      const double s = number(node, station);
      expect(before >= 0 ? s > before : s == 0, fmt::format("<{}> {} = {} after {}", name, station, s, before));
      in_range(node, station, 0, length);
      before = s;
    }
  }

  void check_road(const pugi::xml_node& road) {
    owner_ = fmt::format("road {}", road.attribute("id").value());
    requires_attributes(road, {"id", "length", "junction"});
    const double length = number(road, "length");
    expect(length > 0, "length");
    ascends(road.child("planView"), "geometry", "s", length);
    double s = 0;
    for (const pugi::xml_node& geometry : road.child("planView").children("geometry")) {
      requires_attributes(geometry, {"s", "x", "y", "hdg", "length"});
      expect(std::abs(number(geometry, "s") - s) < 1e-6, "geometry does not begin where the one before it ends");
      expect(std::distance(geometry.begin(), geometry.end()) == 1, "geometry of one kind");
      s += number(geometry, "length");
    }
    expect(std::abs(s - length) < 1e-6, "geometries are not as long as the road");
    ascends(road.child("elevationProfile"), "elevation", "s", length);
    ascends(road.child("lanes"), "laneSection", "s", length);
    std::vector<pugi::xml_node> sections;
    for (const pugi::xml_node& section : road.child("lanes").children("laneSection")) sections.push_back(section);
    expect(!sections.empty(), "no lane section");
    for (std::size_t i = 0; i < sections.size(); ++i) {
      const double end = i + 1 < sections.size() ? number(sections[i + 1], "s") : length;
      check_section(sections[i], end - number(sections[i], "s"));
      if (i > 0) check_section_links(sections[i - 1], sections[i]);
    }
    for (const bool at_start : {true, false}) check_road_link(road, at_start);
  }

  void check_section(const pugi::xml_node& section, double length) {
    const pugi::xml_node center = section.child("center");
    expect(std::distance(center.begin(), center.end()) == 1 && is(center.child("lane"), "id", "0"), "center lane");
    int expected = static_cast<int>(std::distance(section.child("left").begin(), section.child("left").end()));
    expect(expected > 0 || section.child("right").child("lane"), "no lanes beside the center");
    for (const pugi::xml_node& lane : section.child("left").children("lane")) {
      expect(lane.attribute("id").as_int() == expected--, "left lanes descend to 1");
    }
    expected = 0;
    for (const pugi::xml_node& lane : section.child("right").children("lane")) {
      expect(lane.attribute("id").as_int() == --expected, "right lanes descend from -1");
    }
    for (const pugi::xml_node& lane : lanes_of(section)) {
      requires_attributes(lane, {"id", "type", "level"});
      expect(lane.child("width"), "lane without width");
      ascends(lane, "width", "sOffset", length);
      ascends(lane, "roadMark", "sOffset", length);
      for (double s = 0; s <= length; s += 0.5) {
        expect(cubic_at(lane, "width", "sOffset", s).value > -1e-9, "negative width");
      }
    }
  }

  /// Checks that links of adjacent sections are mutual.
  void check_section_links(const pugi::xml_node& before, const pugi::xml_node& after) {
    const auto agree = [&](const pugi::xml_node& from, const pugi::xml_node& to, const char* on, const char* back) {
      for (const pugi::xml_node& lane : lanes_of(from)) {
        const pugi::xml_node link = lane.child("link").child(on);
        if (!link) continue;
        bool is_mutual = false;
        for (const pugi::xml_node& other : lanes_of(to)) {
          is_mutual = is_mutual || (is(other, "id", link.attribute("id").value()) &&
                                    is(other.child("link").child(back), "id", lane.attribute("id").value()));
        }
        expect(is_mutual, fmt::format("lane {}: {} of the section", lane.attribute("id").value(), on));
      }
    };
    agree(before, after, "successor", "predecessor");
    agree(after, before, "predecessor", "successor");
  }

  void check_road_link(const pugi::xml_node& road, bool at_start) {
    const char* const direction = at_start ? "predecessor" : "successor";
    const pugi::xml_node link = road.child("link").child(direction);
    if (!link) return;
    requires_attributes(link, {"elementType", "elementId"});
    if (is(link, "elementType", "junction")) {
      expect(root_.find_child_by_attribute("junction", "id", link.attribute("elementId").value()),
             "link to a junction");
      return;
    }
    requires_attributes(link, {"contactPoint"});
    const pugi::xml_node other = text_.road(link.attribute("elementId").value());
    expect(other, "link to a road");
    const bool other_start = is(link, "contactPoint", "start");
    const bool in_junction = !is(road, "junction", "-1");
    const pugi::xml_node back = other.child("link").child(other_start ? "predecessor" : "successor");
    if (in_junction) {
      expect(is(back, "elementType", "junction") && is(back, "elementId", road.attribute("junction").value()),
             "a connecting road ends at a road of its junction");
    } else {
      expect(
          is(back, "elementId", road.attribute("id").value()) && is(back, "contactPoint", at_start ? "start" : "end"),
          "road link is not mutual");
    }
    for (const pugi::xml_node& lane : lanes_of(end_section(road, at_start))) {
      const pugi::xml_node next = lane.child("link").child(direction);
      if (!next) continue;
      const pugi::xml_node linked = lane_at(other, next.attribute("id").as_int(), other_start);
      expect(linked, "lane link to a lane");
      if (in_junction) continue;
      expect(
          is(linked.child("link").child(other_start ? "predecessor" : "successor"), "id", lane.attribute("id").value()),
          "lane link is not mutual");
    }
  }

  void check_junction(const pugi::xml_node& junction) {
    owner_ = fmt::format("junction {}", junction.attribute("id").value());
    requires_attributes(junction, {"id"});
    unique("connection", junction.children("connection"), "id");
    expect(junction.child("connection"), "no connections");
    for (const pugi::xml_node& connection : junction.children("connection")) {
      requires_attributes(connection, {"id", "incomingRoad", "connectingRoad", "contactPoint"});
      const std::string incoming = connection.attribute("incomingRoad").value();
      const pugi::xml_node road = text_.road(connection.attribute("connectingRoad").value());
      const bool at_start = is(connection, "contactPoint", "start");
      const pugi::xml_node link = road.child("link").child(at_start ? "predecessor" : "successor");
      expect(is(road, "junction", junction.attribute("id").value()), "connecting road of another junction");
      expect(is(link, "elementId", incoming.c_str()), "connecting road does not begin at the incoming one");
      expect(connection.child("laneLink"), "connection without lane links");
      for (const pugi::xml_node& lane_link : connection.children("laneLink")) {
        const int from = lane_link.attribute("from").as_int(), to = lane_link.attribute("to").as_int();
        expect(lane_at(text_.road(incoming), from, is(link, "contactPoint", "start")), "lane link from a lane");
        const pugi::xml_node lane = lane_at(road, to, at_start);
        expect(
            lane && lane.child("link").child(at_start ? "predecessor" : "successor").attribute("id").as_int() == from,
            "lane link against the lane's own");
      }
    }
  }

  const OpenDriveText& text_;
  pugi::xml_node root_;
  std::string owner_ = "file";
  std::vector<std::string> violations_;
};

}  // namespace

OpenDriveText::OpenDriveText(const std::string& text) {
  if (!document_.load_buffer(text.data(), text.size())) throw std::runtime_error("not XML");
  for (const pugi::xml_node& road : root().children("road")) roads_[road.attribute("id").value()] = road;
}

std::vector<std::string> violated_rules(const OpenDriveText& text) { return RuleChecker(text).check(); }

Pose on_geometry(const pugi::xml_node& geometry, double ds) {
  const double x = number(geometry, "x"), y = number(geometry, "y"), heading = number(geometry, "hdg");
  const double k = number(geometry.child("arc"), "curvature");
  if (k == 0) return {x + ds * std::cos(heading), y + ds * std::sin(heading), heading};
  // Relative to the centre of the circle.
  const double center_x = x - std::sin(heading) / k, center_y = y + std::cos(heading) / k;
  return {center_x + std::sin(heading + k * ds) / k, center_y - std::cos(heading + k * ds) / k, heading + k * ds};
}

std::vector<pugi::xml_node> lanes_of(const pugi::xml_node& section) {
  std::vector<pugi::xml_node> lanes;
  for (const char* side : {"left", "right"}) {
    for (const pugi::xml_node& lane : section.child(side).children("lane")) lanes.push_back(lane);
  }
  return lanes;
}

pugi::xml_node lane_at(const pugi::xml_node& road, int lane, bool at_start) {
  for (const pugi::xml_node& candidate : lanes_of(end_section(road, at_start))) {
    if (candidate.attribute("id").as_int() == lane) return candidate;
  }
  return {};
}

LaneEnd lane_end(const pugi::xml_node& road, int lane, bool at_start) {
  const double s = at_start ? 0 : number(road, "length");
  const double in_section = s - number(end_section(road, at_start), "s");
  const pugi::xml_node plan = road.child("planView");
  const Pose pose = at_start ? on_geometry(plan.first_child(), 0)
                             : on_geometry(plan.last_child(), number(plan.last_child(), "length"));
  const int side = lane > 0 ? 1 : -1;
  double inner = 0, outer = 0;
  for (int i = side; std::abs(i) <= std::abs(lane); i += side) {
    inner = outer;
    outer += cubic_at(lane_at(road, i, at_start), "width", "sOffset", in_section).value;
  }
  const double nx = -std::sin(pose.heading) * side, ny = std::cos(pose.heading) * side;
  const ValueAndSlope height = cubic_at(road.child("elevationProfile"), "elevation", "s", s);
  return {pose.x + inner * nx, pose.y + inner * ny, pose.x + outer * nx, pose.y + outer * ny,
          pose.heading,        height.value,        height.slope};
}

}  // namespace pictura::test
