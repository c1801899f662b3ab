// Whether a road lies where a road can lie: checked once, so that what is built from it need not ask again.
#pragma once

#include "pictura/map/opendrive/faults.h"
#include "pictura/map/opendrive/model.h"

namespace pictura::opendrive {

/// Throws Error unless offsets, heights and banking of the road are of this world everywhere. A lane whose width falls
/// below zero is a fault of the lane; where that is let pass, the lane becomes void.
void check_extent(Faults* faults, FileRoad* road);

}  // namespace pictura::opendrive
