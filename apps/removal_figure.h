// The figure of `pictura probe removal`.
#pragma once

#include <string>
#include <vector>

#include "pictura/evaluation/probes/removal_results.h"

namespace pictura {

/// Draws, as the paper's figure, the absolute changes of value and braking probability over how occluded the user was,
/// a line a policy with its 95 % interval over scenes; below, those of wholly hidden users over their distance. Throws
/// Error naming the path.
void draw_removal_figure(const RemovalResults& results, const std::vector<RemovalRow>& rows, const std::string& path);

}  // namespace pictura
