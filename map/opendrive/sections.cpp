#include "pictura/map/opendrive/sections.h"

#include <algorithm>

#include "pictura/map/opendrive/element.h"

namespace pictura::opendrive {

namespace {

constexpr double kMinSplitSection_m = 0.5;
constexpr double kSameStation_m = 1e-6;  // tolerance for the rounding of writers

/// Returns the same cubic with its start at s.
Cubic moved_to(double s, const Cubic& cubic) {
  const double ds = s - cubic.s;
  return {.s = s,
          .a = cubic.a + ds * (cubic.b + ds * (cubic.c + ds * cubic.d)),
          .b = cubic.b + ds * (2 * cubic.c + ds * 3 * cubic.d),
          .c = cubic.c + ds * 3 * cubic.d,
          .d = cubic.d};
}

void shift(Profile* profile, double ds) {
  for (Cubic& cubic : profile->cubics) cubic.s -= ds;
}

FileLane continue_lane(const FileLane& lane, double ds) {
  FileLane rest = lane;
  rest.is_continued = true;
  for (Profile* profile : {&rest.width, &rest.border, &rest.inner_height, &rest.outer_height, &rest.speed_limit_mps}) {
    shift(profile, ds);
  }
  for (RoadMark& mark : rest.marks) mark.s_offset -= ds;
  return rest;
}

std::size_t num_records(const FileLane& lane) {
  return lane.marks.size() + lane.width.cubics.size() + lane.border.cubics.size() + lane.inner_height.cubics.size() +
         lane.outer_height.cubics.size() + lane.speed_limit_mps.cubics.size();
}

/// Returns the stations of speed limit changes, sorted.
std::vector<double> speed_changes(const FileRoad& road, const FileSection& section) {
  std::vector<double> changes;
  auto add_all = [&](const Profile& limits, double offset) {
    double before = 0;
    for (const Cubic& limit : limits.cubics) {
      if (limit.a != before) changes.push_back(limit.s + offset);
      before = limit.a;
    }
  };
  add_all(road.speed_limit_mps, 0);
  for (const std::vector<FileLane>* side : {&section.left, &section.right}) {
    for (const FileLane& lane : *side) add_all(lane.speed_limit_mps, section.s);
  }
  std::sort(changes.begin(), changes.end());
  return changes;
}

/// Replaces the links of a section's lanes to the lanes of an adjacent section, which is removed. The new links lead to
/// the lanes to which the removed lanes were linked.
void link_across(const FileSection& removed, std::vector<int> FileLane::* links, FileSection* section) {
  for (std::vector<FileLane>* side : {&section->left, &section->right}) {
    for (FileLane& lane : *side) {
      // Targets are unique, because repeated links would double with every removed section.
      std::vector<int> targets;
      for (const int id : lane.*links) {
        const FileLane* through = removed.lane(id);
        if (!through) continue;
        for (const int target : through->*links) {
          if (std::find(targets.begin(), targets.end(), target) == targets.end()) targets.push_back(target);
        }
      }
      lane.*links = targets;
    }
  }
}

/// Removes a profile's records within [begin, end). If the road continues beyond `end` and no record begins there, the
/// last removed record is continued from `end`.
void cut_out(double begin, double end, bool goes_on, Profile* profile) {
  std::vector<Cubic>& cubics = profile->cubics;
  const auto from = [&](double s) {
    return std::lower_bound(cubics.begin(), cubics.end(), s - kSameStation_m,
                            [](const Cubic& cubic, double at) { return cubic.s < at; });
  };
  auto first = from(begin);
  const auto last = from(end);
  if (first == last) return;
  if (goes_on && (last == cubics.end() || last->s > end + kSameStation_m)) {
    *first = moved_to(end, *(last - 1));
    ++first;
  }
  cubics.erase(first, last);
}

/// Makes a profile constant from s on, unless it has records that begin more than a millimetre beyond s.
void hold(double s, Profile* profile) {
  std::vector<Cubic>& cubics = profile->cubics;
  if (cubics.empty() || cubics.back().s > s + kStationTolerance_m) return;
  const double value = profile->value(s);
  std::erase_if(cubics, [s](const Cubic& cubic) { return cubic.s >= s; });
  cubics.push_back({.s = s, .a = value});
}

}  // namespace

void bridge_section(std::size_t index, FileRoad* road) {
  std::vector<FileSection>& sections = road->sections;
  const FileSection removed = std::move(sections[index]);
  const bool goes_on = index + 1 < sections.size();
  // Otherwise, a lane offset that applies only within the removed section would shift the ends of adjacent sections.
  cut_out(removed.s, removed.end, goes_on, &road->lane_offset);
  if (index > 0) {
    link_across(removed, &FileLane::successors, &sections[index - 1]);
    sections[index - 1].end = removed.end;
  }
  // The next section keeps its start, because its cubics and marks are relative to its start.
  if (goes_on) link_across(removed, &FileLane::predecessors, &sections[index + 1]);
  sections.erase(sections.begin() + static_cast<std::ptrdiff_t>(index));
}

void hold_profiles(double s, FileRoad* road) {
  if (s >= road->length) return;
  for (Profile* profile :
       {&road->elevation, &road->lane_offset, &road->superelevation, &road->left_crossfall, &road->right_crossfall}) {
    hold(s, profile);
  }
  FileSection& last = road->sections.back();
  if (last.s > s + kStationTolerance_m) return;
  for (std::vector<FileLane>* side : {&last.left, &last.right}) {
    for (FileLane& lane : *side) {
      for (Profile* profile : {&lane.width, &lane.border}) hold(std::max(s - last.s, 0.0), profile);
    }
  }
}

std::vector<FileLane> continue_lanes(std::vector<FileLane>* lanes, double ds, std::size_t* copied_inout) {
  constexpr std::size_t kMaxCopiedRecords = 1'000'000;
  std::vector<FileLane> rest;
  for (FileLane& lane : *lanes) {
    *copied_inout += num_records(lane);
    if (*copied_inout > kMaxCopiedRecords) {
      lane.where.fail("expected at most {} records on a road's lanes that continue in later sections",
                      kMaxCopiedRecords);
    }
    rest.push_back(continue_lane(lane, ds));
    rest.back().predecessors = lane.successors = {lane.id};
  }
  return rest;
}

const FileSection& section_at(const FileRoad& road, double s) {
  std::size_t section = road.sections.size() - 1;
  while (section > 0 && road.sections[section].s > s) --section;
  return road.sections[section];
}

bool split_section(double s, FileRoad* road) {
  const std::ptrdiff_t index = &section_at(*road, s) - road->sections.data();
  FileSection& section = road->sections[index];
  if (s < section.s + kMinSplitSection_m || s > section.end - kMinSplitSection_m) return false;
  const double ds = s - section.s;
  FileSection rest;
  rest.s = s;
  rest.end = section.end;
  rest.center = continue_lane(section.center, ds);
  rest.left = continue_lanes(&section.left, ds, &road->num_copied_records);
  rest.right = continue_lanes(&section.right, ds, &road->num_copied_records);
  section.end = s;
  road->sections.insert(road->sections.begin() + index + 1, std::move(rest));
  return true;
}

void split_at_speed_changes(Network* network) {
  for (FileRoad& road : network->roads) {
    for (std::size_t i = 0; i < road.sections.size(); ++i) {
      for (const double change : speed_changes(road, road.sections[i])) {
        if (change > road.sections[i].s && change < road.sections[i].end && split_section(change, &road)) ++i;
      }
    }
  }
}

}  // namespace pictura::opendrive
