// Sections cut in two: lanes that go on from one FileSection into the next are the same lane of the file.
#pragma once

#include <vector>

#include "pictura/map/opendrive/model.h"

namespace pictura::opendrive {

/// What is left of `lanes` from `ds` behind their section's s on, as lanes of a section that begins there. The lanes
/// and what is left of them are linked to each other.
std::vector<FileLane> lanes_further_on(std::vector<FileLane>* lanes, double ds);

/// Cuts sections where the speed limit of the road or of one of its lanes changes, so that a lane has one limit.
/// Changes within 0.5 m of a section's end count from there.
void split_at_speed_changes(Network* network);

}  // namespace pictura::opendrive
