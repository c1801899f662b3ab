// Checks that a road's offsets, heights, banking and widths are plausible, so that later stages need not check again.
#pragma once

#include "pictura/common/error.h"
#include "pictura/map/opendrive/faults.h"
#include "pictura/map/opendrive/model.h"

namespace pictura::opendrive {

/// Throws Error unless offsets, heights and banking are within limits along the whole road. A lane whose width is below
/// zero is a fault of the lane; in lenient mode that lane becomes void.
void check_extent(Faults* faults, FileRoad* road);

}  // namespace pictura::opendrive
