// Importer of the Waymo Open Motion Dataset (WOMD). It reads one `Scenario` message (proto2, package
// waymo.open_dataset) as a scene, without protobuf. The field numbers are those of the dataset's scenario.proto and
// map.proto.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "pictura/common/error_types.h"
#include "pictura/map/scenario/logged_scene.h"
#include "pictura/map/womd/tfrecord.h"

namespace pictura::womd {

/// Parses a record's payload. `source` is the record's name in messages ("FILE: record 3"); the scenario's id is added
/// to it. Accepts fields in any order, and packed and unpacked repeated numbers. Throws Error "SOURCE (scenario ID):
/// FIELD: ..." if the bytes are not a `Scenario` message, or if a point of the map or a valid state has a number that
/// is not finite. Also throws Error if the number of states or signals differs from the number of timestamps, or if
/// there are more than 4 million points and states in total.
LoggedScene parse_scenario(std::string_view payload, const std::string& source);

/// Returns the scenario_id of a record, or an empty string if it has none. Reads only a small part of the record.
/// Throws FieldError if the bytes are not a message.
std::string scan_scenario_id(const ByteSource& source, RecordPlace place);

}  // namespace pictura::womd
