// Checks and repairs the links between roads and junctions.
#pragma once

#include "pictura/map/opendrive/faults.h"
#include "pictura/map/opendrive/model.h"

namespace pictura::opendrive {

/// Repairs links as action_of() describes. Afterwards, all targets of links exist, contact points are known, and
/// Connection::incoming_end is set.
void repair_links(Network* network, Faults* faults);

}  // namespace pictura::opendrive
