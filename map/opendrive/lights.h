// Traffic lights along a road, away from junctions.
#pragma once

#include <vector>

#include "pictura/map/opendrive/model.h"

namespace pictura::opendrive {

/// Type of traffic lights.
inline constexpr std::string_view kLightType = "1000001";

/// Whether a signal or reference applies to a lane of its road. Its validity takes precedence over its orientation.
bool applies_to(const FileLane& lane, const FileRoad& road, Orientation orientation,
                const std::vector<LaneRange>& validity);

/// Splits sections at the stop lines of lights that have no controller and whose lanes do not lead to a junction. Heads
/// of one orientation within 20 m share the stop line of the head that traffic reaches first.
void split_at_lights(Network* network);

}  // namespace pictura::opendrive
