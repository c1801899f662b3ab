// Loading of maps, with a report of the files' repairs on stderr.
#pragma once

#include <memory>
#include <string>

#include "pictura/map/load_map.h"

namespace pictura {

/// Calls load_map(), and reports on stderr if faults of the file were repaired.
std::shared_ptr<const RoadMap> load_reported_map(const std::string& name);

/// Prints a line on stderr for each kind of repaired fault: the number of faults, the repair, and the first fault.
/// `source` is the file's name in messages.
void print_repairs(const RoadMap& map, const std::string& source);

}  // namespace pictura
