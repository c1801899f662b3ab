// A map from above as the shapes of a replay.
#pragma once

#include <vector>

#include "pictura/replay/replay.h"
#include "pictura/simulator/compiled_map.h"

namespace pictura {

/// In the order in which they cover each other; lights stand last, in the order of the map.
std::vector<ReplayShape> map_shapes(const CompiledMap& map);

}  // namespace pictura
