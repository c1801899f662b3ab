// Picture of `pictura probe corner`.
#pragma once

#include <string>

#include "pictura/evaluation/probes/corner_results.h"

namespace pictura {

/// Draws the pair at whose reveal policies' speeds differ most (example_of()) from above, with walls and without, in
/// the colours of the chart below. Throws Error naming the path.
void draw_corner_example(const CornerResults& results, const std::string& path);

}  // namespace pictura
