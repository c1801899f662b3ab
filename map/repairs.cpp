#include "pictura/map/repairs.h"

#include <algorithm>

#include <fmt/format.h>

namespace pictura {

namespace {

struct Text {
  const char *fault, *action;
};

/// Returns the texts of a kind; empty for invalid kinds.
Text text_of(RepairKind kind) {
  switch (kind) {
    case RepairKind::record_order: return {"records out of order", "sorted by their stations"};
    case RepairKind::record_beyond_end: return {"records beyond the end of their section or road", "left out"};
    case RepairKind::record_before_start:
      return {"records before the start of their section or road", "they apply from the start"};
    case RepairKind::late_width: return {"first widths after the start of their section", "extended back to the start"};
    case RepairKind::missing_width: return {"lanes without widths", "they have no surface"};
    case RepairKind::negative_width: return {"widths below zero", "counted as zero"};
    case RepairKind::missing_zero: return {"missing coefficients and heights", "counted as zero"};
    case RepairKind::late_section: return {"first sections after the start of their road", "they begin at the start"};
    case RepairKind::lane_gap: return {"lane ids with gaps", "filled by lanes without surface"};
    case RepairKind::center_id: return {"center lanes with another id than 0", "counted as 0"};
    case RepairKind::short_road: return {"roads of no length", "made 1 mm long; their lanes are not counted"};
    case RepairKind::short_section: return {"lane sections of no length", "left out; links lead through them"};
    case RepairKind::empty_geometry: return {"geometries of no length", "left out"};
    case RepairKind::parameter_range:
      return {"parameter ranges that do not fit the length", "the other range counts, which fits"};
    case RepairKind::line_length: return {"curves of another length than stated", "the curve's own length counts"};
    case RepairKind::geometry_station:
      return {"geometries that do not begin where the one before ends", "the one before is cut or extended"};
    case RepairKind::moved_geometry:
      return {"geometries whose s is far from the end of the one before", "moved along s to that end"};
    case RepairKind::geometry_jump:
      return {"jumps of the reference line", "spread over ten metres, or ten times their size if more"};
    case RepairKind::geometry_gap: return {"gaps between geometries", "bridged by a straight line"};
    case RepairKind::height_jump:
      return {"jumps of the elevation", "spread over ten metres, or ten times their size if more"};
    case RepairKind::strip_surface: return {"cross-sections of strips", "flattened"};
    case RepairKind::missing_lane_type:
      return {"lanes without a type", "center lanes get type none, others are special lanes"};
    case RepairKind::unknown_lane_type: return {"unknown lane types", "counted as special lanes"};
    case RepairKind::unknown_direction: return {"unknown lane directions", "counted as standard"};
    case RepairKind::unknown_flag: return {"flags that are neither true nor false", "counted as false"};
    case RepairKind::unknown_mark: return {"unknown types of road marks", "only their lines are painted"};
    case RepairKind::unknown_color: return {"unknown colors of road marks", "painted white"};
    case RepairKind::unknown_lane_change: return {"unknown lane-change rules of road marks", "counted as both"};
    case RepairKind::unknown_orientation: return {"unknown orientations of signals", "they face both ways"};
    case RepairKind::negative_size: return {"sizes below zero", "the default size counts"};
    case RepairKind::endless_dash: return {"dashes of no length", "painted without gaps"};
    case RepairKind::empty_line: return {"explicit mark lines of no length", "left out"};
    case RepairKind::self_crossing_mark: return {"road marks that run back on themselves", "that part is left out"};
    case RepairKind::unreadable_speed: return {"speed limits that cannot be read", "left out"};
    case RepairKind::misplaced_item: return {"objects and signals far from their road", "left out"};
    case RepairKind::shapeless_object: return {"objects without the size that they need", "left out"};
    case RepairKind::continuous_object: return {"objects repeated without distance", "placed once"};
    case RepairKind::repeated_corners: return {"repeated objects with corners along the road", "placed once"};
    case RepairKind::unsupported_junction: return {"junctions of kinds that are not supported", "they connect nothing"};
    case RepairKind::link_into_road: return {"links to the middle of a road", "left out"};
    case RepairKind::missing_road: return {"references to roads that do not exist", "left out"};
    case RepairKind::missing_lane: return {"links to lanes that do not exist", "left out"};
    case RepairKind::missing_contact: return {"links without a contact point", "the nearest end counts"};
    case RepairKind::wrong_end: return {"links to the wrong end of a road", "the end that touches counts"};
    case RepairKind::one_sided_link: return {"one-sided links of roads", "made mutual"};
    case RepairKind::unreturned_link:
      return {"links to a road end that is itself linked to another road", "kept, because the ends touch"};
    case RepairKind::contrary_link:
      return {"links to a road's end that is linked elsewhere and does not touch", "left out"};
    case RepairKind::dangling_link: return {"links of lanes at a road end without a road link", "left out"};
    case RepairKind::unlike_link: return {"links of lanes of different types", "left out"};
    case RepairKind::opposed_link: return {"links of lanes of opposite traffic", "left out"};
    case RepairKind::distant_link: return {"links of lanes that do not touch", "left out"};
    case RepairKind::missing_junction: return {"references to junctions that do not exist", "left out"};
    case RepairKind::unconnected_road: return {"connections of roads that do not meet the junction", "left out"};
    case RepairKind::repeated_signal: return {"signal ids used twice", "all are kept; references mean the first"};
    case RepairKind::missing_signal: return {"references to signals that do not exist", "left out"};
    case RepairKind::repeated_controller: return {"controller ids used twice", "the first counts"};
    case RepairKind::missing_controller: return {"references to controllers that do not exist", "left out"};
    case RepairKind::uncontrolled_light:
      return {"lights without a controller",
              "at junctions, similar headings share a phase; elsewhere each light has its own cycle"};
    case RepairKind::unlisted_light: return {"lights that are in no controller of their junction", "left out"};
    case RepairKind::laneless_light: return {"lights without a lane", "left out"};
    case RepairKind::missing_link:
      return {"missing links between lanes that touch", "routes end with the lane that lacks a link"};
    case RepairKind::repeated_element: return {"element ids used twice", "the first counts"};
    case RepairKind::missing_element: return {"references to elements that do not exist", "left out"};
    case RepairKind::missing_position: return {"points without a position", "left out"};
    case RepairKind::short_way: return {"lines of fewer than two points", "left out"};
    case RepairKind::borderless_lanelet: return {"lanelets without one left and one right border", "left out"};
    case RepairKind::empty_lanelet: return {"lanelets of no length", "left out"};
    case RepairKind::unknown_subtype: return {"unknown subtypes of lanelets", "read as lanes of type other"};
    case RepairKind::open_area: return {"areas whose outline is not closed or crosses itself", "left out"};
    case RepairKind::empty_rule: return {"incomplete regulatory elements", "left out"};
  }
  return {"unknown", "unknown"};
}

}  // namespace

const char* to_string(RepairKind kind) { return text_of(kind).fault; }
const char* action_of(RepairKind kind) { return text_of(kind).action; }

std::vector<RepairKind> repair_kinds() {
  std::vector<RepairKind> kinds;
  for (int i = 0; i <= static_cast<int>(RepairKind::empty_rule); ++i) kinds.push_back(static_cast<RepairKind>(i));
  return kinds;
}

std::string message_of(const Repair& repair, const std::string& source) {
  return fmt::format("{}:{}: {}", source, repair.line, repair.message);
}

std::vector<RepairGroup> group_repairs(Span<const Repair> repairs) {
  std::vector<RepairGroup> groups;
  for (const RepairKind kind : repair_kinds()) groups.push_back({kind, {}});
  for (const Repair& repair : repairs) groups[static_cast<size_t>(repair.kind)].repairs.push_back(&repair);
  std::erase_if(groups, [](const RepairGroup& group) { return group.repairs.empty(); });
  for (RepairGroup& group : groups) {
    std::stable_sort(group.repairs.begin(), group.repairs.end(),
                     [](const Repair* a, const Repair* b) { return a->line < b->line; });
  }
  std::stable_sort(groups.begin(), groups.end(),
                   [](const RepairGroup& a, const RepairGroup& b) { return a.repairs.size() > b.repairs.size(); });
  return groups;
}

std::vector<std::string> describe_repairs(Span<const Repair> repairs, const std::string& source) {
  std::vector<std::string> lines;
  for (const RepairGroup& group : group_repairs(repairs)) {
    lines.push_back(fmt::format("{} x {}: {}; first: {}", group.repairs.size(), to_string(group.kind),
                                action_of(group.kind), message_of(*group.repairs.front(), source)));
  }
  return lines;
}

}  // namespace pictura
