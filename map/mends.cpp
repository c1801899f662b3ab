#include "pictura/map/mends.h"

#include <algorithm>

#include <fmt/format.h>

namespace pictura {

namespace {

struct Text {
  const char *fault, *action;
};

/// Returns the texts of a kind; empty for invalid kinds.
Text text_of(MendKind kind) {
  switch (kind) {
    case MendKind::record_order: return {"records out of order", "sorted by their stations"};
    case MendKind::record_beyond_end: return {"records beyond the end of their section or road", "left out"};
    case MendKind::record_before_start:
      return {"records before the start of their section or road", "they apply from the start"};
    case MendKind::late_width: return {"first widths after the start of their section", "extended back to the start"};
    case MendKind::missing_width: return {"lanes without widths", "they have no surface"};
    case MendKind::negative_width: return {"widths below zero", "counted as zero"};
    case MendKind::missing_zero: return {"missing coefficients and heights", "counted as zero"};
    case MendKind::late_section: return {"first sections after the start of their road", "they begin at the start"};
    case MendKind::lane_gap: return {"lane ids with gaps", "filled by lanes without surface"};
    case MendKind::center_id: return {"center lanes with another id than 0", "counted as 0"};
    case MendKind::short_road: return {"roads of no length", "they are 1 mm long and not counted"};
    case MendKind::short_section: return {"lane sections of no length", "left out; links lead through them"};
    case MendKind::empty_geometry: return {"geometries of no length", "left out"};
    case MendKind::parameter_range:
      return {"parameter ranges that do not fit the length", "the range that fits counts"};
    case MendKind::line_length: return {"curves of another length than stated", "the curve's own length counts"};
    case MendKind::geometry_station:
      return {"geometries that do not begin where the one before ends", "the one before is cut or extended"};
    case MendKind::moved_geometry: return {"geometries far from where the one before ends along s", "moved along s"};
    case MendKind::geometry_jump:
      return {"jumps of the reference line", "spread over ten metres, or ten times their size"};
    case MendKind::geometry_gap: return {"gaps between geometries", "bridged by a straight line"};
    case MendKind::height_jump: return {"jumps of the elevation", "spread over ten metres, or ten times their size"};
    case MendKind::strip_surface: return {"cross-sections of strips", "flattened"};
    case MendKind::missing_lane_type:
      return {"lanes without a type", "counted as none in the center, as special lanes elsewhere"};
    case MendKind::unknown_lane_type: return {"unknown lane types", "counted as special lanes"};
    case MendKind::unknown_direction: return {"unknown lane directions", "counted as standard"};
    case MendKind::unknown_flag: return {"flags that are neither true nor false", "counted as false"};
    case MendKind::unknown_mark: return {"unknown types of road marks", "painted by their lines; without lines, not"};
    case MendKind::unknown_color: return {"unknown colors of road marks", "painted white"};
    case MendKind::unknown_lane_change: return {"unknown lane-change rules of road marks", "counted as both"};
    case MendKind::unknown_orientation: return {"unknown orientations of signals", "they face both ways"};
    case MendKind::negative_size: return {"sizes below zero", "the default size counts"};
    case MendKind::endless_dash: return {"dashes of no length", "painted without gaps"};
    case MendKind::empty_line: return {"single mark lines of no length", "left out"};
    case MendKind::self_crossing_mark: return {"road marks that run back on themselves", "that part is left out"};
    case MendKind::unreadable_speed: return {"speed limits that cannot be read", "left out"};
    case MendKind::misplaced_item: return {"objects and signals far from their road", "left out"};
    case MendKind::shapeless_object: return {"objects without the size that they need", "left out"};
    case MendKind::continuous_object: return {"objects repeated without distance", "they stand once"};
    case MendKind::repeated_corners: return {"repeated objects with corners along the road", "they stand once"};
    case MendKind::unsupported_junction: return {"junctions of kinds that are not supported", "they connect nothing"};
    case MendKind::link_into_road: return {"links to the middle of a road", "left out"};
    case MendKind::missing_road: return {"references to roads that do not exist", "left out"};
    case MendKind::missing_lane: return {"links to lanes that do not exist", "left out"};
    case MendKind::missing_contact: return {"links without a contact point", "the nearest end counts"};
    case MendKind::wrong_end: return {"links to the wrong end of a road", "the end that touches counts"};
    case MendKind::one_sided_link: return {"links of roads that are not returned", "made mutual"};
    case MendKind::unreturned_link: return {"links of roads that are returned elsewhere", "kept, since the ends touch"};
    case MendKind::contrary_link: return {"links of roads that do not touch and are returned elsewhere", "left out"};
    case MendKind::dangling_link:
      return {"links of lanes at an end of their road that is linked to nothing", "left out"};
    case MendKind::unlike_link: return {"links of lanes of unlike types", "left out"};
    case MendKind::opposed_link: return {"links of lanes of opposite traffic", "left out"};
    case MendKind::distant_link: return {"links of lanes that do not touch", "left out"};
    case MendKind::missing_junction: return {"references to junctions that do not exist", "left out"};
    case MendKind::unconnected_road: return {"connections of roads that do not meet the junction", "left out"};
    case MendKind::repeated_signal: return {"signal ids used twice", "all stand; references mean the first"};
    case MendKind::missing_signal: return {"references to signals that do not exist", "left out"};
    case MendKind::repeated_controller: return {"controller ids used twice", "the first counts"};
    case MendKind::missing_controller: return {"references to controllers that do not exist", "left out"};
    case MendKind::uncontrolled_light:
      return {"lights without a controller", "they cycle by heading at junctions, alone elsewhere"};
    case MendKind::unlisted_light: return {"lights that the controllers of their junction leave out", "left out"};
    case MendKind::laneless_light: return {"lights without a lane", "left out"};
    case MendKind::missing_link: return {"lanes that end without a link where others begin", "routes end before them"};
    case MendKind::repeated_element: return {"element ids used twice", "the first counts"};
    case MendKind::missing_element: return {"references to elements that do not exist", "left out"};
    case MendKind::missing_position: return {"points without a position", "left out"};
    case MendKind::short_way: return {"lines of fewer than two points", "left out"};
    case MendKind::borderless_lanelet: return {"lanelets without one left and one right border", "left out"};
    case MendKind::empty_lanelet: return {"lanelets of no length", "left out"};
    case MendKind::unknown_subtype: return {"unknown subtypes of lanelets", "counted as other lanes"};
    case MendKind::open_area: return {"areas whose outline is not closed or crosses itself", "left out"};
    case MendKind::empty_rule: return {"regulatory elements without what they need", "left out"};
  }
  return {"unknown", "unknown"};
}

}  // namespace

const char* to_string(MendKind kind) { return text_of(kind).fault; }
const char* action_of(MendKind kind) { return text_of(kind).action; }

std::vector<MendKind> mend_kinds() {
  std::vector<MendKind> kinds;
  for (int i = 0; i <= static_cast<int>(MendKind::empty_rule); ++i) kinds.push_back(static_cast<MendKind>(i));
  return kinds;
}

std::string message_of(const Mend& mend, const std::string& source) {
  return fmt::format("{}:{}: {}", source, mend.line, mend.message);
}

std::vector<MendGroup> group_mends(Span<const Mend> mends) {
  std::vector<MendGroup> groups;
  for (const MendKind kind : mend_kinds()) groups.push_back({kind, {}});
  for (const Mend& mend : mends) groups[static_cast<size_t>(mend.kind)].mends.push_back(&mend);
  std::erase_if(groups, [](const MendGroup& group) { return group.mends.empty(); });
  for (MendGroup& group : groups) {
    std::stable_sort(group.mends.begin(), group.mends.end(),
                     [](const Mend* a, const Mend* b) { return a->line < b->line; });
  }
  std::stable_sort(groups.begin(), groups.end(),
                   [](const MendGroup& a, const MendGroup& b) { return a.mends.size() > b.mends.size(); });
  return groups;
}

std::vector<std::string> describe_mends(Span<const Mend> mends, const std::string& source) {
  std::vector<std::string> lines;
  for (const MendGroup& group : group_mends(mends)) {
    lines.push_back(fmt::format("{} x {}: {}; first: {}", group.mends.size(), to_string(group.kind),
                                action_of(group.kind), message_of(*group.mends.front(), source)));
  }
  return lines;
}

}  // namespace pictura
