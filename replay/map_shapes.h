// A map as replays hold it: its shapes from above, and what cameras see of it.
#pragma once

#include <vector>

#include "pictura/replay/replay.h"
#include "pictura/simulator/compiled_map.h"

namespace pictura {

/// In the order in which they cover each other; lights stand last, in the order of the map.
std::vector<ReplayShape> map_shapes(const CompiledMap& map);

/// What renderers draw of it. Strips that go on where the one before ended are one line.
ReplayScenery map_scenery(const StaticGeometry& geometry);

}  // namespace pictura
