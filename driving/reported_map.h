// Loads maps, and reports repairs of their files on stderr.
#pragma once

#include <memory>
#include <string>

#include "pictura/map/load_map.h"

namespace pictura {

/// Returns the map that load_map() loads. Reports on stderr if faults of the file were repaired.
std::shared_ptr<const RoadMap> load_reported_map(const std::string& name);

/// Prints a line on stderr for each kind of repaired fault, with the number of faults, the repair, and the first fault.
/// `source` is the file's name in messages.
void print_repairs(const RoadMap& map, const std::string& source);

}  // namespace pictura
