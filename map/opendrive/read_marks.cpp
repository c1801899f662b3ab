// Reads road marks: type, colour, width, and explicitly listed lines.
#include <cmath>
#include <unordered_map>
#include <unordered_set>

#include "pictura/map/opendrive/read_parts.h"

namespace pictura::opendrive {

namespace {

constexpr double kMaxMarkWidth_m = 10;
constexpr double kMinDashPeriod_m = 0.05;  // bounds the number of dashes

MarkColor mark_color(const Element& element, const std::string& name) {
  static const std::unordered_map<std::string_view, MarkColor> kColors = {
      {"standard", MarkColor::white}, {"white", MarkColor::white},   {"yellow", MarkColor::yellow},
      {"red", MarkColor::red},        {"green", MarkColor::green},   {"blue", MarkColor::blue},
      {"orange", MarkColor::orange},  {"violet", MarkColor::violet}, {"black", MarkColor::black},
  };
  const auto found = kColors.find(name);
  if (found == kColors.end()) element.fail("attribute color: '{}' is not a mark's color of OpenDRIVE 1.4 to 1.8", name);
  return found->second;
}

LaneChange lane_change(const Element& element) {
  const std::string text = element.text("laneChange", "both");
  if (text == "both") return LaneChange::both;
  if (text == "increase") return LaneChange::increase;
  if (text == "decrease") return LaneChange::decrease;
  if (text == "none") return LaneChange::none;
  element.fail("attribute laneChange: expected both, increase, decrease or none, got '{}'", text);
}

void check_type(const Element& element, const std::string& type) {
  static const std::unordered_set<std::string_view> kTypes = {
      "none",          "solid",      "broken", "solid solid", "solid broken", "broken solid",
      "broken broken", "botts dots", "grass",  "curb",        "custom",       "edge"};
  if (!kTypes.contains(type)) {
    element.fail("attribute type: '{}' is not a road mark's type of OpenDRIVE 1.4 to 1.8", type);
  }
}

MarkLine read_line(const Element& element, bool is_explicit) {
  MarkLine line;
  line.length = element.number_in("length", 0, kMaxRoadLength_m);
  if (!is_explicit) line.space = element.number_in("space", 0, kMaxRoadLength_m);
  if (line.length + line.space < kMinDashPeriod_m) {
    element.fail("attribute length: expected at least {} m with the space, got {}", kMinDashPeriod_m,
                 line.length + line.space);
  }
  line.t_offset = element.number_in("tOffset", -kMaxMarkWidth_m, kMaxMarkWidth_m);
  line.s_offset = element.number_in("sOffset", -kMaxRoadLength_m, kMaxRoadLength_m);
  line.width = element.number_in("width", 0, kMaxMarkWidth_m, 0);
  if (element.has("color")) line.color = mark_color(element, element.text("color"));
  return line;
}

RoadMark read_mark(const Element& element, double section_length) {
  RoadMark mark;
  mark.where = element.where();
  mark.s_offset = element.number("sOffset", 0);
  mark.type = element.text("type");
  check_type(element, mark.type);
  mark.bold = element.text("weight", "standard") == "bold";
  mark.color = mark_color(element, element.text("color", "standard"));
  mark.width = element.number_in("width", 0, kMaxMarkWidth_m, 0);
  mark.lane_change = lane_change(element);
  if (const Element type = element.child("type")) {
    if (mark.width == 0) mark.width = type.number_in("width", 0, kMaxMarkWidth_m, 0);
    type.each("line", [&](const Element& line) { mark.lines.push_back(read_line(line, false)); });
  }
  if (const Element lines = element.child("explicit")) {
    lines.each("line", [&](const Element& line) { mark.explicit_lines.push_back(read_line(line, true)); });
  }
  mark.sway = read_profile(element, "sway", "ds", section_length);
  return mark;
}

}  // namespace

std::vector<RoadMark> read_marks(const Element& lane_element, double section_length, Faults* faults) {
  std::vector<RoadMark> marks;
  lane_element.each("roadMark", [&](const Element& element) {
    faults->attempt([&] {
      RoadMark mark = read_mark(element, section_length);
      // Marks that begin after the section's end occur in CARLA's towns; they are invisible.
      if (mark.s_offset > section_length + kStationTolerance_m) return;
      if (!marks.empty() && mark.s_offset < marks.back().s_offset) {
        element.fail("attribute sOffset: expected at least the previous one's {}, got {}", marks.back().s_offset,
                     mark.s_offset);
      }
      marks.push_back(std::move(mark));
    });
  });
  return marks;
}

}  // namespace pictura::opendrive
