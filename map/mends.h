// Mends: faults of a map's file that have one sensible meaning, what the importer made of each, and their count by
// kind.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pictura/common/span.h"

namespace pictura {

/// The kinds, in the order of the table in docs/reference/opendrive_conformance.md.
enum class MendKind : uint8_t {
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
};

/// The fault, as "records out of order", and what is done about it, as "sorted".
const char* to_string(MendKind kind);
const char* action_of(MendKind kind);

/// All kinds, in order.
std::vector<MendKind> mend_kinds();

struct Mend {
  MendKind kind = MendKind::record_order;
  int32_t line = 0;     // of the element in the file
  std::string message;  // OWNER: <element>: what was expected and what came
};

/// "FILE:LINE: OWNER: <element>: ...", as errors read; `source` names the file.
std::string message_of(const Mend& mend, const std::string& source);

struct MendGroup {
  MendKind kind = MendKind::record_order;
  std::vector<const Mend*> mends;  // in the order of their lines; not empty
};

/// The mends of each kind that occurs, the most frequent kinds first. Refers to `mends`.
std::vector<MendGroup> group_mends(Span<const Mend> mends);

/// One line a kind: how many, what was done, and the first one's message. Empty without mends.
std::vector<std::string> describe_mends(Span<const Mend> mends, const std::string& source);

}  // namespace pictura
