// Converts a map to the form of replays: its shapes from above, and the geometry that cameras see.
#pragma once

#include <vector>

#include "pictura/replay/replay.h"
#include "pictura/simulator/compiled_map.h"

namespace pictura {

/// Returns the shapes in drawing order. Traffic lights come last, in the order of the map.
std::vector<ReplayShape> map_shapes(const CompiledMap& map);

/// Returns the geometry that renderers draw. If a strip continues the previous strip, it extends the previous strip's
/// line.
ReplayScenery map_scenery(const StaticGeometry& geometry);

}  // namespace pictura
