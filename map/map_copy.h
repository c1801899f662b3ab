// Affine copies of maps: their names, and the linear map of the plan for each name.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/map/plan_map.h"

namespace pictura {

constexpr int kMaxMapCopies = 1024;  // per map
constexpr int kMaxTownRange = 4096;  // towns per range of seeds

// Ranges from which a copy's scale and shear (along x, by y) are drawn uniformly; the rotation is drawn from all
// angles.
constexpr float kMinCopyScale = 0.85f, kMaxCopyScale = 1.2f;
constexpr float kMaxCopyShear = 0.1f;

/// Components of MAP#COPY: a map and the number of its copy, from 1. Copy 0 is the map itself.
struct MapCopy {
  std::string_view map;
  int copy = 0;
};

/// Splits a name. Throws UsageError naming it when the number after # is not in 1 to kMaxMapCopies. Text after # that
/// is not a number belongs to the map's name.
MapCopy parse_map_copy(std::string_view name);

/// Returns "MAP#COPY".
std::string map_copy_name(std::string_view map, int copy);

/// Draws the scale, shear and rotation of a copy's plan. The result depends only on the map's name ("Town01",
/// "procedural:7") and the copy's number, so that a copy's name means the same town everywhere.
PlanMap draw_map_copy(std::string_view map_name, int copy);

/// Expands every range of procedural towns, such as procedural:1000-1063 or city:1-4:blocks=2x2, into names. Throws
/// UsageError naming the range unless its ends ascend and it has at most kMaxTownRange towns.
std::vector<std::string> expand_map_names(const std::vector<std::string>& names);

/// Returns the maps, then copy 1 of each map, and so on up to `copies`.
std::vector<std::string> with_map_copies(std::vector<std::string> maps, int copies);

}  // namespace pictura
