// Imports OpenDRIVE (.xodr) files as RoadMaps.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "pictura/common/error.h"
#include "pictura/map/road_map.h"

namespace pictura {

struct OpenDriveOptions {
  float chord_error_m = 0.02f;  // maximum distance of a sampled curve from the true one
  bool lenient = false;         // skip faulty parts if the rest still makes a map
};

/// Parses the text of an OpenDRIVE file. `source` names it in messages. Throws Error naming source, line, owner and
/// element for anything malformed; in lenient mode `warnings_out` (unless null) gets such a message for every skipped
/// part, and only faults that leave no map throw.
RoadMap parse_opendrive(std::string_view text, const std::string& source, const OpenDriveOptions& options = {},
                        std::vector<std::string>* warnings_out = nullptr);

}  // namespace pictura
