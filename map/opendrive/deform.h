// Deforms a network into an affine copy whose lanes keep their widths.
#pragma once

#include "pictura/map/opendrive/model.h"

namespace pictura::opendrive {

/// Maps the plan of a network; stations, lateral positions, heights and speed limits stay. Reference lines go where
/// `plan` takes them. Lateral positions t are measured from the mapped reference line, perpendicular to it, so every
/// width keeps its metres. Where roads are linked but their reference lines do not meet, as in junctions, roads are
/// shifted so that their lanes meet as before: at each link by the distance between the two lines times the plan's
/// change of scale across them. Roads outside junctions are shifted as a whole where links allow that; along the others
/// the shift changes smoothly from end to end.
void deform(const PlanMap& plan, Network* network);

}  // namespace pictura::opendrive
