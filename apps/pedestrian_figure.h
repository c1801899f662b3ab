// Pictures of `pictura probe pedestrian`.
#pragma once

#include <functional>

#include "pictura/common/support/filled_folder.h"
#include "pictura/common/support/json.h"
#include "pictura/evaluation/probes/pedestrian_results.h"

namespace pictura {

/// Draws path_000.png and so on in a folder: a path from above, coloured by the pedestrian's visibility, and the ego's
/// cameras at five points. `on_path` is called with the number of completed paths. Returns the pages for pictura.plot,
/// which draws the changes along the path below the pictures. Throws Error naming the path.
Json draw_pedestrian_paths(const PedestrianResults& results, FilledFolder* folder,
                           const std::function<void(size_t)>& on_path);

}  // namespace pictura
