// Affine copies of maps: their names, and the map of the plan that each name stands for.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/map/plan_map.h"

namespace pictura {

constexpr int kMaxMapCopies = 1024;  // of one map
constexpr int kMaxTownRange = 4096;  // towns that one range of seeds names

// From these ranges the scale, the shear (along x, by y) and the rotation of a copy are drawn uniformly.
constexpr float kMinCopyScale = 0.85f, kMaxCopyScale = 1.2f;
constexpr float kMaxCopyShear = 0.1f;

/// What MAP#COPY names: a copy, numbered from 1, of another map; copy 0 is the map itself.
struct MapCopy {
  std::string_view map;
  int copy = 0;
};

/// Splits a name. Throws UsageError naming it when the number after # is not in 1 to kMaxMapCopies. What follows a #
/// and is no number belongs to the map's name.
MapCopy parse_map_copy(std::string_view name);

/// MAP#COPY.
std::string map_copy_name(std::string_view map, int copy);

/// The scaled, sheared and rotated plan of a copy: a function of the map's name ("Town01", "procedural:7") and the
/// copy's number alone, so that a copy's name means the same town everywhere.
PlanMap draw_map_copy(std::string_view map_name, int copy);

/// The names with every range of procedural towns, as procedural:1000-1063 or city:1-4:blocks=2x2, in full.
/// Throws UsageError naming the range unless its ends ascend and it has at most kMaxTownRange towns.
std::vector<std::string> expand_map_names(const std::vector<std::string>& names);

/// The maps, then copy 1 of each, and so on up to `copies`.
std::vector<std::string> with_map_copies(std::vector<std::string> maps, int copies);

}  // namespace pictura
