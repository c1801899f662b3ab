// Splits and removes sections, and ends their profiles; lanes that continue from one FileSection into the next are the
// same lane of the file.
#pragma once

#include <vector>

#include "pictura/map/opendrive/model.h"

namespace pictura::opendrive {

/// The parts of `lanes` that are more than `ds` after the start of their section, as lanes of a new section that begins
/// there. The lanes and their continuations are linked to each other.
std::vector<FileLane> continue_lanes(std::vector<FileLane>* lanes, double ds);

/// Removes a section without length: the one before it ends where it ended, links lead through it, and the lane offset
/// is that of the sections beside it.
void bridge_section(std::size_t index, FileRoad* road);

/// Makes elevation, banking, lane offset and widths constant from s on, where the file describes no more: cubics are
/// not extrapolated.
void hold_profiles(double s, FileRoad* road);

/// The last section that begins at s or before it, or the first one.
const FileSection& section_at(const FileRoad& road, double s);

/// Splits the section at s in two, unless s is within 0.5 m of its ends. Returns whether it did.
bool split_section(double s, FileRoad* road);

/// Splits sections where the speed limit of the road or of one of its lanes changes, so that each lane has one limit.
/// Changes within 0.5 m of a section's ends are not split.
void split_at_speed_changes(Network* network);

}  // namespace pictura::opendrive
