// Picture of `pictura probe corner`.
#pragma once

#include <string>

#include "pictura/evaluation/probes/corner_results.h"

namespace pictura {

/// Draws example_of() from above, with and without walls, in the colours of the probe's chart. Throws Error naming the
/// path.
void draw_corner_example(const CornerResults& results, const std::string& path);

}  // namespace pictura
