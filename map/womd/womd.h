// Waymo Open Motion Dataset: one `Scenario` message (proto2, package waymo.open_dataset) as a scene. Read without
// protobuf; the field numbers are those of the dataset's scenario.proto and map.proto.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "pictura/common/error_types.h"
#include "pictura/map/scenario/logged_scene.h"
#include "pictura/map/womd/tfrecord.h"

namespace pictura::womd {

/// Parses a record's payload; `source` is the record's name in messages ("FILE: record 3"), to which the scenario's id
/// is added. Accepts fields in any order, and packed and unpacked repeated numbers. Throws Error "SOURCE (scenario ID):
/// FIELD: ..." for bytes that are not a `Scenario` message, and for points of the map or valid states with numbers that
/// are not finite. Also throws Error for more or fewer states or signals than timestamps, and for a total of more than
/// 4 M points and states.
LoggedScene parse_scenario(std::string_view payload, const std::string& source);

/// Returns the scenario_id of a record, reading only a small part of it; empty if there is none. Throws FieldError for
/// bytes that are not a message.
std::string scan_scenario_id(const ByteSource& source, RecordPlace place);

}  // namespace pictura::womd
