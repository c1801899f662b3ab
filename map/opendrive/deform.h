// Deformation of a network into an affine copy whose lanes keep their widths.
#pragma once

#include "pictura/map/opendrive/model.h"

namespace pictura::opendrive {

/// Deforms the reference lines by `plan`. Stations s, lateral positions t, heights and speed limits do not change.
/// Reference lines of linked roads can be apart, for example in junctions. Such roads are shifted so that their lanes
/// still meet. A road outside junctions is shifted as a whole if its links allow it. Otherwise, the shift changes
/// smoothly from end to end.
void deform(const PlanMap& plan, Network* network);

}  // namespace pictura::opendrive
