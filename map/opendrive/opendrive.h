// OpenDRIVE (.xodr) to RoadMap.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "pictura/map/road_map.h"

namespace pictura {

struct OpenDriveOptions {
  float chord_error_m = 0.02f;  // greatest distance of a sampled curve from the true one
  // Faulty parts are left out where the rest makes a map without them, each with a message in `warnings`, instead of
  // ending the reading.
  bool lenient = false;
  std::vector<std::string>* warnings = nullptr;
};

/// Parses the text of an OpenDRIVE file. `source` names it in messages. Throws Error naming source, road, element and
/// line for anything malformed.
RoadMap parse_opendrive(std::string_view text, const std::string& source, const OpenDriveOptions& options = {});

/// Reads and parses a file.
RoadMap load_opendrive(const std::string& path, const OpenDriveOptions& options = {});

}  // namespace pictura
