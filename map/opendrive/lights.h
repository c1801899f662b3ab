// Traffic lights that stand on a road, away from junctions.
#pragma once

#include <vector>

#include "pictura/map/opendrive/model.h"

namespace pictura::opendrive {

/// The type of signals that are traffic lights.
inline constexpr std::string_view kLightType = "1000001";

/// Whether a signal or reference applies to a lane of its road: by its validity, else by its orientation.
bool applies_to(const FileLane& lane, const FileRoad& road, Orientation orientation,
                const std::vector<LaneRange>& validity);

/// Splits sections at the stop lines of lights that no controller controls and from which no lane leads to a junction.
/// The heads of one orientation within 20 m have one line, where traffic meets the first of them.
void split_at_lights(Network* network);

}  // namespace pictura::opendrive
