// The StaticGeometry of a RoadMap: markings, edges, crosswalks, stop lines, walls and light heads.
#pragma once

#include <array>
#include <string>

#include "pictura/common/error_types.h"
#include "pictura/common/scene.h"
#include "pictura/map/road_map.h"

namespace pictura {

/// Placement of light heads. `as_mapped`: at the map's positions. `visible`: heads less than kVisibleHeadAhead_m beyond
/// the middle of their stop line, or before it, are moved in the direction of the line's traffic to that distance.
/// There they stand kVisibleHeadHeight_m above the road of their lanes, with the same lateral side and facing. So the
/// cameras of a vehicle that waits at the line see the head.
enum class LightHeads : uint8_t { as_mapped, visible };
constexpr std::array<const char*, 2> kLightHeadsNames{"as_mapped", "visible"};
constexpr float kVisibleHeadAhead_m = 10.0f, kVisibleHeadHeight_m = 3.5f;

/// Returns the placement that has this name. Throws UsageError listing the valid names if there is none.
LightHeads light_heads_named(const std::string& name);
std::string name_of(LightHeads heads);

struct MapGeometryOptions {
  bool walls = true;                        // draw walls along the building lines
  uint64_t wall_seed = 0;                   // selects the pieces of building lines that have walls
  float light_half_angle_rad = kPi / 3.0f;  // half of the angle within which a head is visible (60 degrees)
  LightHeads light_heads = LightHeads::as_mapped;
};

/// The map's static geometry; signal i of a head is map.lights[i].
StaticGeometry make_static_geometry(const RoadMap& map, const MapGeometryOptions& options = {});

/// Makes the walls for `options.wall_seed`; the simulator uses the same walls for collisions.
std::vector<WallFace> make_walls(const RoadMap& map, const MapGeometryOptions& options);

}  // namespace pictura
