// The figures of `pictura probe pedestrian`.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "pictura/common/support/filled_folder.h"
#include "pictura/evaluation/probes/pedestrian_results.h"

namespace pictura {

/// Draws, as the paper's figure, path_000.png and so on in a folder: a path from above, coloured by how much of the
/// pedestrian is seen, the signed changes of value and braking probability along it, and the ego's cameras at five
/// places; and pedestrian.png, the means over all paths from where the pedestrian is first seen, with their 95 %
/// intervals over scenes. `on_path` is called with the number of paths that are drawn. Throws Error naming the path.
void draw_pedestrian_figures(const PedestrianResults& results, const std::vector<PedestrianRow>& rows,
                             FilledFolder* folder, const std::function<void(size_t)>& on_path);

}  // namespace pictura
