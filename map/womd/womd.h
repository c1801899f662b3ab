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

/// The scene in a record's payload; `source` names the record in messages ("FILE: record 3"), to which the scenario's
/// id is added. Any field order is read; packed and unpacked repeated numbers are. Throws Error "SOURCE (scenario ID):
/// FIELD: ..." for bytes that are no such message, for numbers that are not finite in points of the map and in valid
/// states, for as many states or signals as there are no timestamps, and for more than 4 M points and states in all.
LoggedScene parse_scenario(std::string_view payload, const std::string& source);

/// The scenario_id of a record, reading little of it; empty where there is none. Throws FieldError for bytes that are
/// no message.
std::string scan_scenario_id(const ByteSource& source, RecordPlace place);

}  // namespace pictura::womd
