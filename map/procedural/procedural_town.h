// Generates a town from a seed, as OpenDRIVE text: streets and avenues on a jittered grid, crossings of three to five
// arms, roundabouts, overpasses, slip lanes (for right turns), hills and lights. The text is imported like any other
// OpenDRIVE file.
#pragma once

#include <string>

#include "pictura/common/error_types.h"
#include "pictura/map/procedural/town_options.h"

namespace pictura {

/// Returns the OpenDRIVE text. Equal options give equal bytes. Throws UsageError if an option is out of range.
std::string procedural_town(const TownOptions& options);

}  // namespace pictura
