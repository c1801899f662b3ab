// Repairs of faults in map files. Only faults with a single sensible repair are repaired.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pictura/common/span.h"

namespace pictura {

/// Kinds of repairs, in the order of the tables in docs/reference/opendrive_conformance.md and
/// docs/reference/lanelet2.md.
enum class RepairKind : uint8_t {
  record_order,
  record_beyond_end,
  record_before_start,
  late_width,
  missing_width,
  negative_width,
  missing_zero,
  late_section,
  lane_gap,
  center_id,
  short_road,
  short_section,
  empty_geometry,
  parameter_range,
  line_length,
  geometry_station,
  moved_geometry,
  geometry_jump,
  geometry_gap,
  height_jump,
  strip_surface,
  missing_lane_type,
  unknown_lane_type,
  unknown_direction,
  unknown_flag,
  unknown_mark,
  unknown_color,
  unknown_lane_change,
  unknown_orientation,
  negative_size,
  endless_dash,
  empty_line,
  self_crossing_mark,
  unreadable_speed,
  misplaced_item,
  shapeless_object,
  continuous_object,
  repeated_corners,
  unsupported_junction,
  link_into_road,
  missing_road,
  missing_lane,
  missing_contact,
  wrong_end,
  one_sided_link,
  unreturned_link,
  contrary_link,
  dangling_link,
  unlike_link,
  opposed_link,
  distant_link,
  missing_junction,
  unconnected_road,
  repeated_signal,
  missing_signal,
  repeated_controller,
  missing_controller,
  uncontrolled_light,
  unlisted_light,
  laneless_light,
  missing_link,
  // Repairs of Lanelet2 files:
  repeated_element,
  missing_element,
  missing_position,
  short_way,
  borderless_lanelet,
  empty_lanelet,
  unknown_subtype,
  open_area,
  empty_rule,
};

inline constexpr RepairKind kFirstLanelet2Repair = RepairKind::repeated_element;

/// Returns the fault, such as "records out of order".
const char* to_string(RepairKind kind);
/// Returns the importer's action, such as "sorted by their stations".
const char* action_of(RepairKind kind);

std::vector<RepairKind> repair_kinds();

struct Repair {
  RepairKind kind = RepairKind::record_order;
  int32_t line = 0;
  std::string message;  // "OWNER: <element>: ", the expected and the actual value
};

/// Returns "FILE:LINE: OWNER: <element>: ..."; `source` is the file's name.
std::string message_of(const Repair& repair, const std::string& source);

struct RepairGroup {
  RepairKind kind = RepairKind::record_order;
  std::vector<const Repair*> repairs;  // in the order of their lines; not empty
};

/// Groups repairs by kind, the most frequent kinds first. The groups point into `repairs`.
std::vector<RepairGroup> group_repairs(Span<const Repair> repairs);

/// Returns a line per kind: number of repairs, fault, action, and the first repair's message.
std::vector<std::string> describe_repairs(Span<const Repair> repairs, const std::string& source);

}  // namespace pictura
