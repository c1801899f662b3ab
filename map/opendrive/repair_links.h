// Checks the links between roads and junctions of a whole file, and repairs links whose meaning follows from geometry
// or from the linked road. Later stages can therefore follow every link.
#pragma once

#include "pictura/map/opendrive/faults.h"
#include "pictura/map/opendrive/model.h"

namespace pictura::opendrive {

/// Repairs links as action_of() describes. Afterwards, all targets of road links, junctions of roads, and roads of
/// connections exist. Contact points are known, and Connection::incoming_end is set.
void repair_links(Network* network, Faults* faults);

}  // namespace pictura::opendrive
