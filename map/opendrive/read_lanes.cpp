// Reads lane sections: lanes with their widths, links and road marks.
#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "pictura/map/opendrive/read_parts.h"
#include "pictura/map/opendrive/sections.h"

namespace pictura::opendrive {

namespace {

// Shorter sections, which editors leave behind when snapping, are removed: no lane can be built from them.
constexpr double kMinSection_m = 1e-3;
constexpr double kMaxLaneWidth_m = 1e3, kMaxLaneHeight_m = 100;
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

Profile read_constants(const Element& lane, const char* name, double section_length,
                       double (*value_of)(const Element&)) {
  Profile profile;
  lane.each(name, [&](const Element& element) {
    const double s = element.number_in("sOffset", 0, section_length + kStationTolerance_m, 0);
    if (!profile.cubics.empty() && s < profile.cubics.back().s) {
      element.fail("attribute sOffset: expected at least the previous one's {}, got {}", profile.cubics.back().s, s);
    }
    profile.cubics.push_back({.s = s, .a = value_of(element)});
  });
  return profile;
}

LaneDirection read_direction(const Element& element) {
  const std::string text = element.text("direction", "standard");
  if (text == "standard") return LaneDirection::standard;
  if (text == "reversed") return LaneDirection::reversed;
  if (text == "both") return LaneDirection::both;
  element.fail("attribute direction: expected standard, reversed or both, got '{}'", text);
}

void read_type(const Element& element, FileLane* lane) {
  lane->type_name = element.text("type");
  lane->type = lane_type(element, lane->type_name);
  lane->is_void = lane->type_name == "none";
  lane->is_level = element.flag("level");
  lane->direction = read_direction(element);
  if (lane->direction == LaneDirection::both && lane->type == LaneType::driving) lane->type = LaneType::bidirectional;
}

void read_width(const Element& element, double section_length, FileLane* lane) {
  const bool by_border = !element.child("width") && element.child("border");
  const char* const name = by_border ? "border" : "width";
  const Profile profile = read_profile(element, name, "sOffset", section_length);
  if (profile.cubics.empty()) element.fail("expected a <width> or <border> in it, found none");
  if (std::abs(profile.cubics.front().s) > kStationTolerance_m) {
    element.fail("expected its first <{}> at sOffset 0, got {}", name, profile.cubics.front().s);
  }
  for (const Cubic& cubic : profile.cubics) {
    const double low = by_border ? -kMaxOffset_m : -kStationTolerance_m;
    const double high = by_border ? kMaxOffset_m : kMaxLaneWidth_m;
    if (!(cubic.a >= low && cubic.a <= high)) {
      element.fail("<{}> attribute a: expected a number in [{}, {}] m, got {}", name, low, high, cubic.a);
    }
  }
  (by_border ? lane->border : lane->width) = profile;
}

FileLane read_lane(const Element& element, double section_length, Faults* faults) {
  FileLane lane;
  lane.where = element.where();
  lane.id = element.integer("id");
  // A faulty lane keeps its index, without a surface.
  bool is_sound = faults->attempt([&] { read_type(element, &lane); });
  if (const Element link = element.child("link")) {
    link.each("predecessor",
              [&](const Element& end) { faults->attempt([&] { lane.predecessors.push_back(end.integer("id")); }); });
    link.each("successor",
              [&](const Element& end) { faults->attempt([&] { lane.successors.push_back(end.integer("id")); }); });
  }
  lane.marks = read_marks(element, section_length, faults);
  if (lane.id == 0) return lane;
  is_sound = faults->attempt([&] { read_width(element, section_length, &lane); }) && is_sound;
  faults->attempt([&] {
    lane.inner_height = read_constants(element, "height", section_length, [](const Element& e) {
      return e.number_in("inner", -kMaxLaneHeight_m, kMaxLaneHeight_m);
    });
    lane.outer_height = read_constants(element, "height", section_length, [](const Element& e) {
      return e.number_in("outer", -kMaxLaneHeight_m, kMaxLaneHeight_m);
    });
  });
  faults->attempt([&] { lane.speed_limit_mps = read_constants(element, "speed", section_length, &read_speed_mps); });
  lane.is_void = lane.is_void || !is_sound;
  return lane;
}

FileLane read_center_lane(const Element& element, double section_length, Faults* faults) {
  if (const int id = element.integer("id"); id != 0) {
    element.fail("attribute id: expected 0 for the center lane, got {}", id);
  }
  return read_lane(element, section_length, faults);
}

void read_side(const Element& section, const char* side, int sign, double section_length, Faults* faults,
               std::vector<FileLane>* lanes_out) {
  const Element parent = section.child(side);
  if (!parent) return;
  parent.each("lane", [&](const Element& element) {
    FileLane lane = read_lane(element, section_length, faults);
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

/// Removes a section from the road and connects its neighbours' lane links across it.
void bridge_section(std::vector<FileSection>* sections, std::size_t index) {
  const FileSection removed = (*sections)[index];
  auto link_across = [&](FileSection& section, std::vector<int> FileLane::* links) {
    for (std::vector<FileLane>* side : {&section.left, &section.right}) {
      for (FileLane& lane : *side) {
        std::vector<int> targets;
        for (const int id : lane.*links) {
          if (const FileLane* through = removed.lane(id)) {
            targets.insert(targets.end(), (through->*links).begin(), (through->*links).end());
          }
        }
        lane.*links = targets;
      }
    }
  };
  if (index > 0) {
    link_across((*sections)[index - 1], &FileLane::successors);
    (*sections)[index - 1].end = removed.end;
  }
  if (index + 1 < sections->size()) {
    FileSection& next = (*sections)[index + 1];
    link_across(next, &FileLane::predecessors);
    // The next section keeps its start, to which its cubics and marks are relative.
  }
  sections->erase(sections->begin() + static_cast<std::ptrdiff_t>(index));
}

/// Reads the sections. A singleSide section gives one side; the lanes of the other side continue.
std::vector<FileSection> read_sections(const Element& lanes, double road_length, Faults* faults) {
  std::vector<Element> elements;
  lanes.each("laneSection", [&](const Element& element) { elements.push_back(element); });
  if (elements.empty()) lanes.fail("expected a <laneSection> in it, found none");
  std::vector<FileSection> sections;
  for (std::size_t i = 0; i < elements.size(); ++i) {
    FileSection section;
    section.s = elements[i].number_in("s", 0, road_length);
    section.end = i + 1 < elements.size() ? elements[i + 1].number_in("s", 0, road_length) : road_length;
    if (i == 0 && section.s > kStationTolerance_m) {
      elements[i].fail("attribute s: expected the first section at 0, got {}", section.s);
    }
    if (section.end < section.s) {
      elements[i + 1].fail("attribute s: expected at least the previous section's {}, got {}", section.s, section.end);
    }
    std::size_t both_sided = i + 1;
    while (both_sided < elements.size() && elements[both_sided].flag("singleSide")) ++both_sided;
    const double lanes_end = both_sided < elements.size() ? elements[both_sided].number("s") : road_length;
    const double length = std::max(lanes_end, section.end) - section.s;
    read_side(elements[i], "left", 1, length, faults, &section.left);
    read_side(elements[i], "right", -1, length, faults, &section.right);
    if (i > 0 && elements[i].flag("singleSide")) {
      FileSection& before = sections.back();
      if (section.left.empty()) section.left = continue_lanes(&before.left, section.s - before.s);
      if (section.right.empty()) section.right = continue_lanes(&before.right, section.s - before.s);
    }
    for (std::vector<FileLane>* side : {&section.left, &section.right}) {
      for (FileLane& lane : *side) lane.section = lane.is_continued ? lane.section : static_cast<int>(i);
    }
    if (const Element center = elements[i].child("center")) {
      if (const Element lane = center.child("lane")) {
        faults->attempt([&] { section.center = read_center_lane(lane, length, faults); });
      }
    }
    sections.push_back(std::move(section));
  }
  return sections;
}

}  // namespace

void read_lanes(const Element& road_element, Faults* faults, FileRoad* road) {
  const Element lanes = road_element.required_child("lanes");
  road->lane_offset = read_profile(lanes, "laneOffset", "s", road->length);
  road->sections = read_sections(lanes, road->length, faults);
  for (std::size_t i = road->sections.size(); i-- > 0;) {
    if (road->sections.size() > 1 && road->sections[i].end - road->sections[i].s < kMinSection_m) {
      bridge_section(&road->sections, i);
    }
  }
}

}  // namespace pictura::opendrive
