// Checks that a road's offsets, heights, banking and widths are plausible.
#pragma once

#include "pictura/common/error_types.h"
#include "pictura/map/opendrive/faults.h"
#include "pictura/map/opendrive/model.h"

namespace pictura::opendrive {

/// Throws Error if a value exceeds its limit anywhere along the road. Repair: negative widths count as zero.
void check_extent(const FileRoad& road, Faults* faults);

}  // namespace pictura::opendrive
