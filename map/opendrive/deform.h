// Deformation of a network into an affine copy whose lanes keep their widths.
#pragma once

#include "pictura/map/opendrive/model.h"

namespace pictura::opendrive {

/// Deforms a network by `plan`, which transforms the reference lines. Stations s, lateral positions t, heights and
/// speed limits do not change. Because t is measured perpendicular to the transformed reference line, widths in metres
/// do not change. Reference lines of linked roads can be apart, for example in junctions. Such roads are shifted so
/// that their lanes still meet. At a link, the shifts of two roads differ by the distance between their reference lines
/// times the plan's change of scale across these lines. A road outside junctions is shifted as a whole if its links
/// allow it. Along other roads, the shift changes smoothly from end to end.
void deform(const PlanMap& plan, Network* network);

}  // namespace pictura::opendrive
