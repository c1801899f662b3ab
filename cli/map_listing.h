// List of every element of a map with its source in the file, for `pictura map --json --full`.
#pragma once

#include "pictura/cli/report.h"
#include "pictura/map/road_map.h"

namespace pictura {

/// Prints one JSON object: the keys of `facts`, then `elements` with one array for each vector of RoadMap and one
/// element per line. Positions are in the file's metres, indices those of the arrays. `source` holds what is known of
/// an element's road, line in the file, section and lane.
void print_listing(const Json& facts, const RoadMap& map);

}  // namespace pictura
