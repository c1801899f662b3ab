// Affine copies of maps: their names and their plans (plan_map.h).
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/map/plan_map.h"

namespace pictura {

constexpr int kMaxMapCopies = 1024;  // per map
constexpr int kMaxTownRange = 4096;  // per range of seeds

// Scale and shear (displacement along x per metre of y) are uniform in these ranges. Rotations are uniform in all
// angles.
constexpr float kMinCopyScale = 0.85f, kMaxCopyScale = 1.2f;
constexpr float kMaxCopyShear = 0.1f;

/// Parts of a name MAP#COPY. Copy 0 is the map itself.
struct MapCopy {
  std::string_view map;
  int copy = 0;
};

/// Splits a name at its last #. If no number follows, returns the whole name and copy 0. Throws UsageError, which names
/// the map, if the number is not in [1, kMaxMapCopies].
MapCopy parse_map_copy(std::string_view name);

std::string map_copy_name(std::string_view map, int copy);

/// Draws a copy's plan, which depends only on the arguments. `map_name` is the original's RoadMap::name.
PlanMap draw_map_copy(std::string_view map_name, int copy);

/// Expands ranges of towns, such as procedural:1000-1063 or city:1-4:blocks=2x2. Keeps other names. Throws UsageError,
/// which names the range, if it descends or has more than kMaxTownRange towns.
std::vector<std::string> expand_map_names(const std::vector<std::string>& names);

/// Returns the maps, then copy 1 of each map, and so on up to copy `copies`.
std::vector<std::string> with_map_copies(std::vector<std::string> maps, int copies);

}  // namespace pictura
