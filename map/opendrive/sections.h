// Splits sections; lanes that continue from one FileSection into the next are the same lane of the file.
#pragma once

#include <vector>

#include "pictura/map/opendrive/model.h"

namespace pictura::opendrive {

/// The parts of `lanes` that are more than `ds` after the start of their section, as lanes of a new section that begins
/// there. The lanes and their continuations are linked to each other.
std::vector<FileLane> continue_lanes(std::vector<FileLane>* lanes, double ds);

/// Splits sections where the speed limit of the road or of one of its lanes changes, so that each lane has one limit.
/// Changes within 0.5 m of a section's ends are not split.
void split_at_speed_changes(Network* network);

}  // namespace pictura::opendrive
