// Affine copies of maps: their names, and the linear transformation of the ground plane for each name.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/map/plan_map.h"

namespace pictura {

constexpr int kMaxMapCopies = 1024;  // per map
constexpr int kMaxTownRange = 4096;  // towns per range of seeds

// Ranges of a copy's scale, and of its shear (the displacement along x per metre of y). Scale and shear are drawn
// uniformly from these ranges, and the rotation from all angles.
constexpr float kMinCopyScale = 0.85f, kMaxCopyScale = 1.2f;
constexpr float kMaxCopyShear = 0.1f;

/// Parts of a name MAP#COPY: the map's name, and the number of the copy, from 1. Copy 0 is the map itself.
struct MapCopy {
  std::string_view map;
  int copy = 0;
};

/// Splits a name at its last #. If no number follows the #, the whole name is the map's name. Throws UsageError, which
/// names the map, if the number is not in 1 to kMaxMapCopies.
MapCopy parse_map_copy(std::string_view name);

/// Returns "MAP#COPY".
std::string map_copy_name(std::string_view map, int copy);

/// Draws the scale, shear and rotation of a copy's plan. The result depends only on the map's name ("Town01",
/// "procedural:7") and the copy's number, so a copy's name always means the same map.
PlanMap draw_map_copy(std::string_view map_name, int copy);

/// Expands every range of procedural towns, such as procedural:1000-1063 or city:1-4:blocks=2x2, into the names of its
/// towns. Keeps other names. Throws UsageError, which names the range, if a range descends or has more than
/// kMaxTownRange towns.
std::vector<std::string> expand_map_names(const std::vector<std::string>& names);

/// Returns the names of the maps, then of copy 1 of each map, and so on up to copy `copies`.
std::vector<std::string> with_map_copies(std::vector<std::string> maps, int copies);

}  // namespace pictura
