// Reads road marks: type, colour, width, and explicit lines.
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
  if (found != kColors.end()) return found->second;
  element.record_repair(RepairKind::unknown_color,
                        "attribute color: '{}' is not a mark's color of OpenDRIVE 1.4 to 1.8", name);
  return MarkColor::white;
}

LaneChange lane_change(const Element& element) {
  const std::string text = element.text("laneChange", "both");
  if (text == "increase") return LaneChange::increase;
  if (text == "decrease") return LaneChange::decrease;
  if (text == "none") return LaneChange::none;
  if (text != "both") {
    element.record_repair(RepairKind::unknown_lane_change,
                          "attribute laneChange: expected both, increase, decrease or none, got '{}'", text);
  }
  return LaneChange::both;
}

void check_type(const Element& element, const std::string& type) {
  static const std::unordered_set<std::string_view> kTypes = {
      "none",          "solid",      "broken", "solid solid", "solid broken", "broken solid",
      "broken broken", "botts dots", "grass",  "curb",        "custom",       "edge"};
  if (!kTypes.contains(type)) {
    element.record_repair(RepairKind::unknown_mark,
                          "attribute type: '{}' is not a road mark's type of OpenDRIVE 1.4 to 1.8", type);
  }
}

/// Appends the line of `element`. A line without length and without gaps is continuous, because several writers mean
/// this.
void read_line(const Element& element, bool is_explicit, std::vector<MarkLine>* lines_out) {
  MarkLine line;
  line.length = element.number_or_zero_in("length", 0, kMaxRoadLength_m);
  if (!is_explicit) line.space = element.number_or_zero_in("space", 0, kMaxRoadLength_m);
  if (line.length + line.space < kMinDashPeriod_m) {
    element.record_repair(is_explicit ? RepairKind::empty_line : RepairKind::endless_dash,
                          "attribute length: expected at least {} m with the space, got {}", kMinDashPeriod_m,
                          line.length + line.space);
    if (is_explicit) return;
    line.space = 0;
  }
  line.t_offset = element.number_or_zero_in("tOffset", -kMaxMarkWidth_m, kMaxMarkWidth_m);
  line.s_offset = element.number_or_zero_in("sOffset", -kMaxRoadLength_m, kMaxRoadLength_m);
  line.width = element.size("width", kMaxMarkWidth_m);
  if (element.has("color")) line.color = mark_color(element, element.text("color"));
  lines_out->push_back(line);
}

RoadMark read_mark(const Element& element, double section_length) {
  RoadMark mark;
  mark.where = element.where();
  mark.s_offset = element.number_in("sOffset", -kMaxRoadLength_m, kMaxRoadLength_m, 0);
  if (mark.s_offset < -kStationTolerance_m) {
    element.record_repair(RepairKind::record_before_start, "attribute sOffset: expected a number from 0 on, got {}",
                          mark.s_offset);
  }
  mark.type = element.text("type");
  check_type(element, mark.type);
  mark.bold = element.text("weight", "standard") == "bold";
  mark.color = mark_color(element, element.text("color", "standard"));
  mark.width = element.size("width", kMaxMarkWidth_m);
  mark.lane_change = lane_change(element);
  if (const Element type = element.child("type")) {
    if (mark.width == 0) mark.width = type.size("width", kMaxMarkWidth_m);
    type.each("line", [&](const Element& line) { read_line(line, false, &mark.lines); });
  }
  if (const Element lines = element.child("explicit")) {
    lines.each("line", [&](const Element& line) { read_line(line, true, &mark.explicit_lines); });
  }
  mark.sway = read_profile(element, "sway", "ds", section_length);
  return mark;
}

}  // namespace

std::vector<RoadMark> read_marks(const Element& lane_element, double section_length) {
  std::vector<RoadMark> marks;
  lane_element.each("roadMark", [&](const Element& element) {
    RoadMark mark = read_mark(element, section_length);
    if (mark.s_offset > section_length + kStationTolerance_m) {
      return element.record_repair(RepairKind::record_beyond_end,
                                   "attribute sOffset: expected a number in [0, {}], got {}", section_length,
                                   mark.s_offset);
    }
    append_record(element, "sOffset", &RoadMark::s_offset, std::move(mark), &marks);
  });
  sort_records(&RoadMark::s_offset, &marks);
  return marks;
}

}  // namespace pictura::opendrive
