// Lane sections: lanes with their widths, links and road marks.
#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "pictura/map/opendrive/read_parts.h"

namespace pictura::opendrive {

namespace {

// Sections that editors leave behind when they snap; no lane can be built from less.
constexpr double kMinSection_m = 1e-3;
constexpr double kMaxLaneWidth_m = 1e3;
constexpr int kMaxLanesPerSide = 64;

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
  if (found == kTypes.end()) element.fail("attribute type: '{}' is not a lane type of OpenDRIVE 1.4 to 1.8", name);
  return found->second;
}

void read_marks(const Element& lane, double section_length, std::vector<RoadMark>* marks_out) {
  lane.each("roadMark", [&](const Element& element) {
    RoadMark mark;
    mark.s_offset = element.number("sOffset", 0);
    // Marks that begin behind the section's end are met in CARLA's towns; they show nothing.
    if (mark.s_offset > section_length + kStationTolerance_m) return;
    if (!marks_out->empty() && mark.s_offset < marks_out->back().s_offset) {
      element.fail("attribute sOffset: expected at least the previous one's {}, got {}", marks_out->back().s_offset,
                   mark.s_offset);
    }
    mark.type = element.text("type");
    mark.color = element.text("color", "standard") == "yellow" ? MarkColor::yellow : MarkColor::white;
    if (element.has("width")) mark.width = element.number_in("width", 0, 10);
    marks_out->push_back(mark);
  });
}

FileLane read_lane(const Element& element, double section_length) {
  FileLane lane;
  lane.where = element.where();
  lane.id = element.integer("id");
  lane.type_name = element.text("type");
  lane.type = lane_type(element, lane.type_name);
  lane.is_void = lane.type_name == "none";
  if (const Element link = element.child("link")) {
    if (const Element end = link.child("predecessor")) lane.predecessor = end.integer("id");
    if (const Element end = link.child("successor")) lane.successor = end.integer("id");
  }
  read_marks(element, section_length, &lane.marks);
  if (lane.id == 0) return lane;
  lane.width = read_profile(element, "width", "sOffset", section_length);
  if (lane.width.cubics.empty()) {
    if (element.child("border")) element.fail("lanes given by <border> are not supported; expected <width>");
    element.fail("expected a <width> in it, found none");
  }
  if (std::abs(lane.width.cubics.front().s) > kStationTolerance_m) {
    element.fail("expected its first <width> at sOffset 0, got {}", lane.width.cubics.front().s);
  }
  for (const Cubic& cubic : lane.width.cubics) {
    if (!(cubic.a >= -kStationTolerance_m && cubic.a <= kMaxLaneWidth_m)) {
      element.fail("<width> attribute a: expected a width in [0, {}] m, got {}", kMaxLaneWidth_m, cubic.a);
    }
  }
  return lane;
}

void read_side(const Element& section, const char* side, int sign, double section_length,
               std::vector<FileLane>* lanes_out) {
  const Element parent = section.child(side);
  if (!parent) return;
  parent.each("lane", [&](const Element& element) {
    FileLane lane = read_lane(element, section_length);
    if (lane.id * sign <= 0) element.fail("attribute id: {} does not belong in <{}>", lane.id, side);
    lanes_out->push_back(std::move(lane));
  });
  if (lanes_out->size() > static_cast<std::size_t>(kMaxLanesPerSide)) {
    parent.fail("expected at most {} lanes, got {}", kMaxLanesPerSide, lanes_out->size());
  }
  std::sort(lanes_out->begin(), lanes_out->end(),
            [](const FileLane& a, const FileLane& b) { return std::abs(a.id) < std::abs(b.id); });
  for (std::size_t i = 0; i < lanes_out->size(); ++i) {
    if ((*lanes_out)[i].id != sign * (static_cast<int>(i) + 1)) {
      (*lanes_out)[i].where.fail("attribute id: expected {}, as lanes count from the center without gaps, got {}",
                                 sign * (static_cast<int>(i) + 1), (*lanes_out)[i].id);
    }
  }
}

/// Takes a section out of the road: its neighbours' lane links lead through it.
void bridge_section(std::vector<FileSection>* sections, std::size_t index) {
  const FileSection removed = (*sections)[index];
  auto lead_through = [&](FileSection& section, std::optional<int> FileLane::* link) {
    for (std::vector<FileLane>* side : {&section.left, &section.right}) {
      for (FileLane& lane : *side) {
        if (!(lane.*link)) continue;
        const FileLane* through = removed.lane(*(lane.*link));
        lane.*link = through ? through->*link : std::nullopt;
      }
    }
  };
  if (index > 0) {
    lead_through((*sections)[index - 1], &FileLane::successor);
    (*sections)[index - 1].end = removed.end;
  }
  if (index + 1 < sections->size()) {
    FileSection& next = (*sections)[index + 1];
    lead_through(next, &FileLane::predecessor);
    // Cubics and marks are relative to the section's start, which stays where it is.
  }
  sections->erase(sections->begin() + static_cast<std::ptrdiff_t>(index));
}

}  // namespace

void read_lanes(const Element& road_element, FileRoad* road) {
  const Element lanes = road_element.needed_child("lanes");
  road->lane_offset = read_profile(lanes, "laneOffset", "s", road->length);
  std::vector<Element> elements;
  lanes.each("laneSection", [&](const Element& element) { elements.push_back(element); });
  if (elements.empty()) lanes.fail("expected a <laneSection> in it, found none");
  for (std::size_t i = 0; i < elements.size(); ++i) {
    FileSection section;
    section.s = elements[i].number_in("s", 0, road->length);
    section.end = i + 1 < elements.size() ? elements[i + 1].number_in("s", 0, road->length) : road->length;
    if (i == 0 && section.s > kStationTolerance_m) {
      elements[i].fail("attribute s: expected the first section at 0, got {}", section.s);
    }
    if (section.end < section.s) {
      elements[i + 1].fail("attribute s: expected at least the previous section's {}, got {}", section.s, section.end);
    }
    if (elements[i].text("singleSide", "false") == "true") {
      elements[i].fail("attribute singleSide: one-sided sections are not supported");
    }
    const double length = section.end - section.s;
    read_side(elements[i], "left", 1, length, &section.left);
    read_side(elements[i], "right", -1, length, &section.right);
    if (const Element center = elements[i].child("center")) {
      if (const Element lane = center.child("lane")) section.center = read_lane(lane, length);
    }
    road->sections.push_back(std::move(section));
  }
  for (std::size_t i = road->sections.size(); i-- > 0;) {
    if (road->sections.size() > 1 && road->sections[i].end - road->sections[i].s < kMinSection_m) {
      bridge_section(&road->sections, i);
    }
  }
}

}  // namespace pictura::opendrive
