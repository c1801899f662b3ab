// Generates a town from a seed, as OpenDRIVE text.
#pragma once

#include <string>

#include "pictura/common/error_types.h"
#include "pictura/map/procedural/town_options.h"

namespace pictura {

/// Equal options give equal bytes. Throws UsageError if an option is out of range.
std::string procedural_town(const TownOptions& options);

}  // namespace pictura
