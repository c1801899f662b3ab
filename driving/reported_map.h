// Loading of maps with a report on stderr of what was repaired in their files.
#pragma once

#include <memory>
#include <string>

#include "pictura/map/load_map.h"

namespace pictura {

/// load_map(), with one line on stderr where faults of the file were mended.
std::shared_ptr<const RoadMap> load_reported_map(const std::string& name);

/// A line on stderr for each kind of fault that was mended: how many, what was done, and the first. `source` names the
/// file.
void print_mends(const RoadMap& map, const std::string& source);

}  // namespace pictura
