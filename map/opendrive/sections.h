// Operations on sections: splitting and removing sections, and ending profiles. Lanes that continue from one
// FileSection into the next are one lane of the file.
#pragma once

#include <vector>

#include "pictura/map/opendrive/model.h"

namespace pictura::opendrive {

/// Splits the lanes of a section at `ds` after its start. The lanes keep the parts before; the parts beyond are
/// returned as lanes of a new section. Each lane and its continuation are linked to each other.
std::vector<FileLane> continue_lanes(std::vector<FileLane>* lanes, double ds);

/// Removes a section without length. The previous section is extended to its end, links that led into it lead to the
/// section beyond, and a lane offset that applies only within it is removed.
void bridge_section(std::size_t index, FileRoad* road);

/// Makes elevation, banking, lane offset and widths constant from s on, where the file's description ends, instead of
/// extrapolating their cubics.
void hold_profiles(double s, FileRoad* road);

/// Returns the last section that begins at or before s, or the first section.
const FileSection& section_at(const FileRoad& road, double s);

/// Splits the section at s, unless s is within 0.5 m of its ends. Returns whether it was split.
bool split_section(double s, FileRoad* road);

/// Splits sections where the speed limit of the road or of one of its lanes changes, so that each lane has one limit.
/// Changes within 0.5 m of a section's ends are ignored.
void split_at_speed_changes(Network* network);

}  // namespace pictura::opendrive
