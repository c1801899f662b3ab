// Draws the picture of `pictura probe corner`, which tests policies at blind corners.
#pragma once

#include <string>

#include "pictura/evaluation/probes/corner_results.h"

namespace pictura {

/// Draws the example pair of states (example_of()) from above, once with walls and once without, in the colours of the
/// probe's chart. Throws Error, which names the path, if the picture cannot be written.
void draw_corner_example(const CornerResults& results, const std::string& path);

}  // namespace pictura
