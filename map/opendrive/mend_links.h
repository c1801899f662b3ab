// Checks the links between roads and junctions of a whole file, and mends those that geometry or the other side show
// the meaning of, so that later stages can follow every link.
#pragma once

#include "pictura/map/opendrive/faults.h"
#include "pictura/map/opendrive/model.h"

namespace pictura::opendrive {

/// Afterwards every road link, every road's junction and both roads of every connection exist, contact points are
/// known, and Connection::incoming_end is set. Faults are mended as MendKind says.
void mend_links(Network* network, Faults* faults);

}  // namespace pictura::opendrive
