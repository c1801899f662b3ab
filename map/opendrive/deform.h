// Deformation of a network into an affine copy whose lanes keep their widths.
#pragma once

#include "pictura/map/opendrive/model.h"

namespace pictura::opendrive {

/// Maps a network by `plan`; stations, lateral positions, heights and speed limits do not change. The plan maps
/// reference lines. Lateral positions t are measured from the mapped reference line, perpendicular to it, so widths in
/// metres do not change. If the reference lines of linked roads do not meet, as in junctions, roads are shifted so that
/// their lanes still meet. The shift at such a link is the distance between the two lines times the plan's change of
/// scale across them. Roads outside junctions are shifted as a whole if their links allow it; along other roads, the
/// shift changes smoothly from end to end.
void deform(const PlanMap& plan, Network* network);

}  // namespace pictura::opendrive
