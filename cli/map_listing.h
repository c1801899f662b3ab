// Listing of a map's elements for `pictura map --json --full`.
#pragma once

#include "pictura/cli/report.h"
#include "pictura/map/road_map.h"

namespace pictura {

/// Prints a JSON object: `facts`, then `elements` with an array per vector of RoadMap, one element per line. Positions
/// are file coordinates in metres. An element's `source` contains the road, file line, section and lane, as far as they
/// are known.
void print_listing(const Json& facts, const RoadMap& map);

}  // namespace pictura
