// Lists every element of a map with its source in the file, for `pictura map --json --full`.
#pragma once

#include "pictura/cli/report.h"
#include "pictura/map/road_map.h"

namespace pictura {

/// Prints one JSON object. It contains the keys of `facts`, then `elements`, with an array for each vector of RoadMap
/// and one element per line. Positions are file coordinates in metres, and indices refer to the arrays. `source`
/// contains the element's road, line in the file, section and lane, as far as they are known.
void print_listing(const Json& facts, const RoadMap& map);

}  // namespace pictura
