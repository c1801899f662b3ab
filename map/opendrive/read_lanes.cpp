// Reads lane sections: lanes with their widths, links and road marks.
#include <algorithm>
#include <cmath>
#include <optional>
#include <unordered_map>

#include "pictura/map/opendrive/read_parts.h"
#include "pictura/map/opendrive/sections.h"

namespace pictura::opendrive {

namespace {

// Minimum length of a section. Editors create shorter sections when they snap roads together. These are removed,
// because lanes cannot be built from them.
constexpr double kMinSection_m = 1e-3;
constexpr double kMaxLaneWidth_m = 1e3, kMaxLaneHeight_m = 100;
constexpr int kMaxLanesPerSide = 64;
constexpr double kMaxLateSection_m = 0.5;  // maximum start of the first section that is repaired

LaneType lane_type(const Element& element, const std::string& name) {
  static const std::unordered_map<std::string_view, LaneType> kTypes = {
      {"driving", LaneType::driving},
      {"bidirectional", LaneType::bidirectional},
      {"parking", LaneType::parking},
      {"ramp", LaneType::ramp},
      {"entry", LaneType::ramp},
      {"exit", LaneType::ramp},
      {"onRamp", LaneType::ramp},
      {"offRamp", LaneType::ramp},
      {"connectingRamp", LaneType::ramp},
      {"mwyEntry", LaneType::ramp},
      {"mwyExit", LaneType::ramp},
      {"shoulder", LaneType::shoulder},
      {"slipLane", LaneType::ramp},
      {"sidewalk", LaneType::sidewalk},
      {"walking", LaneType::sidewalk},
      {"biking", LaneType::biking},
      {"median", LaneType::median},
      {"border", LaneType::border},
      {"curb", LaneType::border},
      {"stop", LaneType::stop},
      {"restricted", LaneType::restricted},
      {"none", LaneType::other},
      {"special1", LaneType::other},
      {"special2", LaneType::other},
      {"special3", LaneType::other},
      {"roadWorks", LaneType::restricted},
      {"tram", LaneType::restricted},
      {"rail", LaneType::restricted},
      {"bus", LaneType::driving},
      {"taxi", LaneType::driving},
      {"HOV", LaneType::driving},
      {"shared", LaneType::driving},
  };
  const auto found = kTypes.find(name);
  if (found != kTypes.end()) return found->second;
  element.record_repair(RepairKind::unknown_lane_type,
                        "attribute type: '{}' is not a lane type of OpenDRIVE 1.4 to 1.8", name);
  return LaneType::other;
}

/// Calls read(element, s) for the records `name` of a lane, in the order of the file. Each record contains constants
/// that apply from its station s (sOffset) on.
template <typename Read>
void each_record(const Element& lane, const char* name, double section_length, Read&& read) {
  lane.each(name, [&](const Element& element) {
    if (const std::optional<double> s = read_station(element, "sOffset", section_length, 0)) read(element, *s);
  });
}

void read_heights(const Element& element, double section_length, FileLane* lane) {
  each_record(element, "height", section_length, [&](const Element& height, double s) {
    const auto height_at = [&](const char* side) {
      return Cubic{.s = s, .a = height.number_or_zero_in(side, -kMaxLaneHeight_m, kMaxLaneHeight_m)};
    };
    append_record(height, "sOffset", &Cubic::s, height_at("inner"), &lane->inner_height.cubics);
    lane->outer_height.cubics.push_back(height_at("outer"));
  });
  for (Profile* heights : {&lane->inner_height, &lane->outer_height}) sort_records(&Cubic::s, &heights->cubics);
}

Profile read_lane_speed_limits(const Element& element, double section_length) {
  Profile limits;
  each_record(element, "speed", section_length, [&](const Element& speed, double s) {
    if (const std::optional<double> limit = read_speed_mps(speed)) {
      append_record(speed, "sOffset", &Cubic::s, {.s = s, .a = *limit}, &limits.cubics);
    }
  });
  sort_records(&Cubic::s, &limits.cubics);
  return limits;
}

LaneDirection read_direction(const Element& element) {
  const std::string text = element.text("direction", "standard");
  if (text == "reversed") return LaneDirection::reversed;
  if (text == "both") return LaneDirection::both;
  if (text != "standard") {
    element.record_repair(RepairKind::unknown_direction,
                          "attribute direction: expected standard, reversed or both, got '{}'", text);
  }
  return LaneDirection::standard;
}

/// Reads a lane's type. A lane without a type attribute has no surface if it is a centre lane, and is a special lane
/// otherwise.
void read_type(const Element& element, bool is_center, FileLane* lane) {
  lane->type_name = element.text("type", is_center ? "none" : "special1");
  if (!element.has("type")) element.record_repair(RepairKind::missing_lane_type, "attribute type is missing");
  lane->type = lane_type(element, lane->type_name);
  lane->is_void = lane->type_name == "none";
  lane->is_level = element.flag("level");
  lane->direction = read_direction(element);
  if (lane->direction == LaneDirection::both && lane->type == LaneType::driving) lane->type = LaneType::bidirectional;
}

void read_width(const Element& element, double section_length, FileLane* lane) {
  const bool by_border = !element.child("width") && element.child("border");
  const char* const name = by_border ? "border" : "width";
  Profile profile = read_profile(element, name, "sOffset", section_length);
  if (profile.cubics.empty()) {
    element.record_repair(RepairKind::missing_width, "expected a <width> or <border> inside, found none");
    lane->is_void = true;
    return;
  }
  const Cubic first = profile.cubics.front();
  if (first.s > kStationTolerance_m) {
    element.record_repair(RepairKind::late_width, "expected its first <{}> at sOffset 0, got {}", name, first.s);
    profile.cubics.insert(profile.cubics.begin(), Cubic{.s = 0, .a = first.a});
  }
  const double limit = by_border ? kMaxOffset_m : kMaxLaneWidth_m;
  for (const Cubic& cubic : profile.cubics) {
    if (!(std::abs(cubic.a) <= limit)) {
      element.fail("<{}> attribute a: expected a number in [{}, {}] m, got {}", name, -limit, limit, cubic.a);
    }
  }
  (by_border ? lane->border : lane->width) = std::move(profile);
}

FileLane read_lane(const Element& element, bool is_center, double section_length) {
  FileLane lane;
  lane.where = element.where();
  lane.id = element.integer("id");
  read_type(element, is_center, &lane);
  if (const Element link = element.child("link")) {
    link.each("predecessor", [&](const Element& end) { lane.predecessors.push_back(end.integer("id")); });
    link.each("successor", [&](const Element& end) { lane.successors.push_back(end.integer("id")); });
  }
  lane.marks = read_marks(element, section_length);
  return lane;
}

FileLane read_side_lane(const Element& element, double section_length) {
  FileLane lane = read_lane(element, false, section_length);
  read_width(element, section_length, &lane);
  read_heights(element, section_length, &lane);
  lane.speed_limit_mps = read_lane_speed_limits(element, section_length);
  return lane;
}

FileLane read_center_lane(const Element& element, double section_length) {
  FileLane lane = read_lane(element, true, section_length);
  if (lane.id != 0) {
    element.record_repair(RepairKind::center_id, "attribute id: expected 0 for the center lane, got {}", lane.id);
    lane.id = 0;
  }
  return lane;
}

/// Inserts lanes without surface for the ids that are missing between the sorted lanes of a side.
void fill_gaps(int sign, std::vector<FileLane>* lanes) {
  std::vector<FileLane> filled;
  for (FileLane& lane : *lanes) {
    for (int id = sign * (static_cast<int>(filled.size()) + 1); id != lane.id; id += sign) {
      FileLane gap;
      gap.id = id;
      gap.type_name = "none";
      gap.is_void = true;
      gap.where = lane.where;
      filled.push_back(std::move(gap));
    }
    filled.push_back(std::move(lane));
  }
  *lanes = std::move(filled);
}

void read_side(const Element& section, const char* side, int sign, double section_length,
               std::vector<FileLane>* lanes_out) {
  const Element parent = section.child(side);
  if (!parent) return;
  parent.each("lane", [&](const Element& element) {
    FileLane lane = read_side_lane(element, section_length);
    if (lane.id * sign <= 0) element.fail("attribute id: {} does not belong in <{}>", lane.id, side);
    if (std::abs(lane.id) > kMaxLanesPerSide) {
      element.fail("attribute id: expected at most {} lanes beside the center, got {}", kMaxLanesPerSide, lane.id);
    }
    lanes_out->push_back(std::move(lane));
  });
  std::stable_sort(lanes_out->begin(), lanes_out->end(),
                   [](const FileLane& a, const FileLane& b) { return std::abs(a.id) < std::abs(b.id); });
  int before = 0;
  for (const FileLane& lane : *lanes_out) {
    const int expected = sign * (std::abs(before) + 1);
    constexpr const char* kMessage = "attribute id: expected {}, as lanes count from the center without gaps, got {}";
    if (lane.id == before) lane.where.fail(kMessage, expected, lane.id);
    if (lane.id != expected) parent.record_repair(RepairKind::lane_gap, kMessage, expected, lane.id);
    before = lane.id;
  }
  if (std::abs(before) != static_cast<int>(lanes_out->size())) fill_gaps(sign, lanes_out);
}

/// A <laneSection> element and its start on the road. A section that starts beyond the road's end is moved to the end.
/// So it has no length, and read_lanes() removes it.
struct SectionElement {
  double s = 0;
  Element element;
  bool is_single_sided = false;
  double lanes_end = 0;  // start of the next section that is not single-sided
};

std::vector<SectionElement> section_elements(const Element& lanes, double road_length) {
  std::vector<SectionElement> sections;
  lanes.each("laneSection", [&](const Element& element) {
    const double s = read_station(element, "s", road_length).value_or(road_length);
    append_record(element, "s", &SectionElement::s, {s, element}, &sections);
  });
  if (sections.empty()) lanes.fail("expected a <laneSection> inside, found none");
  sort_records(&SectionElement::s, &sections);
  SectionElement& first = sections.front();
  if (first.s > kStationTolerance_m) {
    constexpr const char* kMessage = "attribute s: expected the first section at 0, got {}";
    if (first.s > kMaxLateSection_m) first.element.fail(kMessage, first.s);
    first.element.record_repair(RepairKind::late_section, kMessage, first.s);
    first.s = 0;
  }
  double lanes_end = road_length;
  for (std::size_t i = sections.size(); i-- > 0;) {
    SectionElement& section = sections[i];
    section.s = std::clamp(section.s, 0.0, road_length);
    section.lanes_end = lanes_end;
    section.is_single_sided = section.element.flag("singleSide");
    if (!section.is_single_sided) lanes_end = section.s;
  }
  return sections;
}

/// Reads the sections. A singleSide section defines the lanes of one side; the lanes of the other side continue.
/// copied_inout: see continue_lanes().
std::vector<FileSection> read_sections(const Element& lanes, double road_length, std::size_t* copied_inout) {
  const std::vector<SectionElement> elements = section_elements(lanes, road_length);
  std::vector<FileSection> sections;
  for (std::size_t i = 0; i < elements.size(); ++i) {
    const Element& element = elements[i].element;
    FileSection section;
    section.where = element.where();
    section.s = elements[i].s;
    section.end = i + 1 < elements.size() ? elements[i + 1].s : road_length;
    const double length = std::max(elements[i].lanes_end, section.end) - section.s;
    read_side(element, "left", 1, length, &section.left);
    read_side(element, "right", -1, length, &section.right);
    if (i > 0 && elements[i].is_single_sided) {
      FileSection& before = sections.back();
      const double ds = section.s - before.s;
      if (section.left.empty()) section.left = continue_lanes(&before.left, ds, copied_inout);
      if (section.right.empty()) section.right = continue_lanes(&before.right, ds, copied_inout);
    }
    for (std::vector<FileLane>* side : {&section.left, &section.right}) {
      for (FileLane& lane : *side) lane.section = lane.is_continued ? lane.section : static_cast<int>(i);
    }
    if (const Element center = element.child("center")) {
      if (const Element lane = center.child("lane")) section.center = read_center_lane(lane, length);
    }
    sections.push_back(std::move(section));
  }
  return sections;
}

}  // namespace

void read_lanes(const Element& road_element, Faults* faults, FileRoad* road) {
  const Element lanes = road_element.required_child("lanes");
  road->lane_offset = read_profile(lanes, "laneOffset", "s", road->length);
  road->sections = read_sections(lanes, road->length, &road->num_copied_records);
  for (std::size_t i = road->sections.size(); i-- > 0;) {
    const FileSection& section = road->sections[i];
    const double length = section.end - section.s;
    if (road->sections.size() == 1 || length >= kMinSection_m) continue;
    if (section.s < road->length) {  // sections beyond the road's end are already recorded
      section.where.record_repair(faults, RepairKind::short_section, "is {} m long; expected at least {}", length,
                                  kMinSection_m);
    }
    bridge_section(i, road);
  }
}

}  // namespace pictura::opendrive
