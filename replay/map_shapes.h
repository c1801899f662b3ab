// Map in the form of replays: its shapes from above, and the geometry that cameras see.
#pragma once

#include <vector>

#include "pictura/replay/replay.h"
#include "pictura/simulator/compiled_map.h"

namespace pictura {

/// Returns the shapes in drawing order; lights come last, in the order of the map.
std::vector<ReplayShape> map_shapes(const CompiledMap& map);

/// Returns the geometry that renderers draw. A strip that continues the previous strip extends its line.
ReplayScenery map_scenery(const StaticGeometry& geometry);

}  // namespace pictura
