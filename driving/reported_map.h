// Loads maps and reports on stderr the repairs of their files.
#pragma once

#include <memory>
#include <string>

#include "pictura/map/load_map.h"

namespace pictura {

/// Calls load_map(), and reports on stderr if faults of the file were repaired.
std::shared_ptr<const RoadMap> load_reported_map(const std::string& name);

/// Prints a line on stderr for each kind of repaired fault: the number, the repair, and the first fault. `source` names
/// the file.
void print_repairs(const RoadMap& map, const std::string& source);

}  // namespace pictura
