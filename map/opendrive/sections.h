// Splits and removes lane sections, and makes profiles constant from a station on.
#pragma once

#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/map/opendrive/model.h"

namespace pictura::opendrive {

/// Splits lanes at `ds` from their section's start, and links both parts. Returns the later parts, which are marked
/// is_continued. *copied_inout counts the road's records that were copied to later parts. Throws Error if there are too
/// many, which bounds memory.
std::vector<FileLane> continue_lanes(std::vector<FileLane>* lanes, double ds, std::size_t* copied_inout);

/// Removes a section without length, and extends the previous section. Links into the removed section lead to the
/// section beyond it. A lane offset that applies only within the removed section is removed.
void bridge_section(std::size_t index, FileRoad* road);

/// Makes elevation, banking, lane offset and widths constant from s on, where the file's description of the road ends.
void hold_profiles(double s, FileRoad* road);

/// Returns the last section that begins at or before s, or the first section.
const FileSection& section_at(const FileRoad& road, double s);

/// Splits the section at s, unless s is within 0.5 m of its ends. Returns whether it did.
bool split_section(double s, FileRoad* road);

/// Splits sections where speed limits change, so that each lane has one limit. Ignores changes within 0.5 m of a
/// section's ends.
void split_at_speed_changes(Network* network);

}  // namespace pictura::opendrive
