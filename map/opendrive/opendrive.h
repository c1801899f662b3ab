// OpenDRIVE (.xodr) to RoadMap.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "pictura/map/road_map.h"

namespace pictura {

struct OpenDriveOptions {
  float chord_error_m = 0.02f;  // greatest distance of a sampled curve from the true one
  bool lenient = false;         // faulty parts are left out where the rest makes a map without them
};

/// Parses the text of an OpenDRIVE file. `source` names it in messages. Throws Error naming source, road, element and
/// line for anything malformed; when lenient, `warnings_out` (unless null) gets a message of that kind for every part
/// left out, and only what leaves no map throws.
RoadMap parse_opendrive(std::string_view text, const std::string& source, const OpenDriveOptions& options = {},
                        std::vector<std::string>* warnings_out = nullptr);

}  // namespace pictura
