// Checks of links between roads and junctions in a whole file. Links whose meaning follows from geometry or from the
// other side are repaired, so that later stages can follow every link.
#pragma once

#include "pictura/map/opendrive/faults.h"
#include "pictura/map/opendrive/model.h"

namespace pictura::opendrive {

/// Repairs links as RepairKind describes. Afterwards every road link, every road's junction and both roads of every
/// connection exist, contact points are known, and Connection::incoming_end is set.
void repair_links(Network* network, Faults* faults);

}  // namespace pictura::opendrive
