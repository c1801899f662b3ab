// Pictures of `pictura probe pedestrian`.
#pragma once

#include <functional>

#include "pictura/common/support/filled_folder.h"
#include "pictura/common/support/json.h"
#include "pictura/evaluation/probes/pedestrian_results.h"

namespace pictura {

/// Writes path_000.png, ...: a path from above, coloured by the pedestrian's visibility, and the ego's camera images at
/// five points. Calls `on_path` with the number of completed paths. Returns the pages for pictura.plot, which draws a
/// chart below each picture. Throws Error naming the file.
Json draw_pedestrian_paths(const PedestrianResults& results, FilledFolder* folder,
                           const std::function<void(size_t)>& on_path);

}  // namespace pictura
