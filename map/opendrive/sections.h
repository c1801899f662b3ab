// Splits and removes lane sections, and makes profiles constant from a station on. After a split, a lane of the file
// has one FileLane in each part; the later ones are marked is_continued.
#pragma once

#include <vector>

#include "pictura/map/opendrive/model.h"

namespace pictura::opendrive {

/// Splits the lanes of a section at the distance `ds` from its start. Returns the parts after the split as lanes of a
/// new section; `lanes` keeps the parts before it. Each lane and its continuation are linked to each other.
std::vector<FileLane> continue_lanes(std::vector<FileLane>* lanes, double ds);

/// Removes a section without length. The previous section is extended to the removed section's end. Links into the
/// removed section lead to the section beyond it. A lane offset that applies only within the removed section is
/// removed.
void bridge_section(std::size_t index, FileRoad* road);

/// Makes elevation, banking, lane offset and widths constant from s on, instead of extrapolating their cubics. s is the
/// station where the file's description of the road ends.
void hold_profiles(double s, FileRoad* road);

/// Returns the last section that begins at or before s, or the first section.
const FileSection& section_at(const FileRoad& road, double s);

/// Splits the section at s, unless s is within 0.5 m of the section's ends. Returns whether the section was split.
bool split_section(double s, FileRoad* road);

/// Splits sections where the speed limit of the road or of one of its lanes changes, so that each lane has one limit.
/// Changes within 0.5 m of a section's ends are ignored.
void split_at_speed_changes(Network* network);

}  // namespace pictura::opendrive
