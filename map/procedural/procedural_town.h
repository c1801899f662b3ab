// Generator of a town from a seed, as OpenDRIVE text: streets and avenues on a jittered grid, crossings of three to
// five arms, roundabouts, overpasses, slip lanes, hills, lights. The text is imported like any other file.
#pragma once

#include <string>

#include "pictura/common/error_types.h"
#include "pictura/map/procedural/town_options.h"

namespace pictura {

/// Returns the .xodr text; equal options give equal bytes. Throws UsageError when an option is out of range.
std::string procedural_town(const TownOptions& options);

}  // namespace pictura
