// The figures of `pictura probe corner`.
#pragma once

#include <string>
#include <vector>

#include "pictura/common/support/filled_folder.h"
#include "pictura/evaluation/probes/corner_results.h"

namespace pictura {

/// Draws, as the paper's figure, corner.png in a folder: mean speeds over time since the takeover, with walls and
/// without, for hidden vehicles, without them, and at empty corners; the strip under each is dark from the 10th to the
/// 90th percentile of the times at which line of sight opens. And example.png: the pair at whose reveal policies'
/// speeds differ most, with walls and without, from above and over time. There must be a pair. Throws Error naming the
/// path.
void draw_corner_figures(const CornerResults& results, const std::vector<CornerRow>& rows, FilledFolder* folder);

}  // namespace pictura
