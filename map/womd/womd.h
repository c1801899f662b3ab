// Importer of the Waymo Open Motion Dataset (WOMD), without protobuf. Field numbers are those of the dataset's
// scenario.proto and map.proto.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "pictura/common/error_types.h"
#include "pictura/map/scenario/logged_scene.h"
#include "pictura/map/womd/tfrecord.h"

namespace pictura::womd {

/// Parses a record's payload; `source` is its name in messages ("FILE: record 3"). Throws Error "SOURCE (scenario ID):
/// FIELD: ..." if the bytes are not a `Scenario` message, or if a map point or valid state is not finite. Also throws
/// Error if the numbers of states, signals and timestamps differ, or for more than 4 million points and states.
LoggedScene parse_scenario(std::string_view payload, const std::string& source);

/// Returns a record's scenario_id, or an empty string. Reads only a small part of the record. Throws FieldError if the
/// bytes are not a message.
std::string scan_scenario_id(const ByteSource& source, RecordPlace place);

}  // namespace pictura::womd
