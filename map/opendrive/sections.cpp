#include "pictura/map/opendrive/sections.h"

#include <algorithm>

namespace pictura::opendrive {

namespace {

constexpr double kMinSplitSection_m = 0.5;

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

/// The stations of speed limit changes, sorted.
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

}  // namespace

std::vector<FileLane> continue_lanes(std::vector<FileLane>* lanes, double ds) {
  std::vector<FileLane> rest;
  for (FileLane& lane : *lanes) {
    rest.push_back(continue_lane(lane, ds));
    rest.back().predecessors = lane.successors = {lane.id};
  }
  return rest;
}

void split_at_speed_changes(Network* network) {
  for (FileRoad& road : network->roads) {
    for (std::size_t i = 0; i < road.sections.size(); ++i) {
      for (const double change : speed_changes(road, road.sections[i])) {
        FileSection& section = road.sections[i];
        if (change < section.s + kMinSplitSection_m || change > section.end - kMinSplitSection_m) continue;
        const double ds = change - section.s;
        FileSection rest;
        rest.s = change;
        rest.end = section.end;
        rest.center = continue_lane(section.center, ds);
        rest.left = continue_lanes(&section.left, ds);
        rest.right = continue_lanes(&section.right, ds);
        section.end = change;
        road.sections.insert(road.sections.begin() + static_cast<std::ptrdiff_t>(++i), std::move(rest));
      }
    }
  }
}

}  // namespace pictura::opendrive
