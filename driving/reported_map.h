// Maps whose repairs are reported on stderr.
#pragma once

#include <memory>
#include <string>

#include "pictura/map/load_map.h"

namespace pictura {

/// Loads as load_map() does.
std::shared_ptr<const RoadMap> load_reported_map(const std::string& name);

/// Prints a line for each kind of repaired fault, with count, repair and first fault. `source`: the file's name in
/// messages.
void print_repairs(const RoadMap& map, const std::string& source);

}  // namespace pictura
