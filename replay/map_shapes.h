// Maps in the form of replays.
#pragma once

#include <vector>

#include "pictura/replay/replay.h"
#include "pictura/simulator/compiled_map.h"

namespace pictura {

/// Returns the shapes from above in drawing order; the last ones are the traffic lights, in the map's order.
std::vector<ReplayShape> map_shapes(const CompiledMap& map);

/// Returns the geometry that cameras see. A strip that continues the previous strip extends its line.
ReplayScenery map_scenery(const StaticGeometry& geometry);

}  // namespace pictura
