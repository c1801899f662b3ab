// Draws the pictures of `pictura probe pedestrian`, which tests policies with pedestrians behind vehicles.
#pragma once

#include <functional>

#include "pictura/common/support/filled_folder.h"
#include "pictura/common/support/json.h"
#include "pictura/evaluation/probes/pedestrian_results.h"

namespace pictura {

/// Writes a picture (path_000.png, ...) of each path into a folder. It shows the path from above, coloured by the
/// pedestrian's visibility, and the ego's camera images at five points. Calls `on_path` with the number of completed
/// paths. Returns the pages for pictura.plot, which draws a chart of each path below its picture. Throws Error, which
/// names the file, if a picture cannot be written.
Json draw_pedestrian_paths(const PedestrianResults& results, FilledFolder* folder,
                           const std::function<void(size_t)>& on_path);

}  // namespace pictura
