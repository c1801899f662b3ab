// Makes the StaticGeometry, the drawn part of a map, from a RoadMap: markings, road edges, crosswalks, stop lines,
// walls and heads of traffic lights.
#pragma once

#include <array>
#include <string>

#include "pictura/common/error_types.h"
#include "pictura/common/scene.h"
#include "pictura/map/road_map.h"

namespace pictura {

/// Placement of the heads of traffic lights. `as_mapped`: at the map's positions. `visible`: a head that is less than
/// kVisibleHeadAhead_m beyond the middle of its stop line is moved to this distance, in the direction of travel. The
/// moved head is kVisibleHeadHeight_m above the road; its lateral position and its facing do not change. So the cameras
/// of a vehicle that waits at the line see the head.
enum class LightHeads : uint8_t { as_mapped, visible };
constexpr std::array<const char*, 2> kLightHeadsNames{"as_mapped", "visible"};
constexpr float kVisibleHeadAhead_m = 10.0f, kVisibleHeadHeight_m = 3.5f;

/// Returns the placement that has this name. Throws UsageError, which lists the valid names, for other names.
LightHeads light_heads_named(const std::string& name);
std::string name_of(LightHeads heads);

struct MapGeometryOptions {
  bool walls = true;                        // include walls along the building lines
  uint64_t wall_seed = 0;                   // selects the pieces of building lines that have walls
  float light_half_angle_rad = kPi / 3.0f;  // 60 degrees; half of the angle within which a head is visible
  LightHeads light_heads = LightHeads::as_mapped;
};

/// Returns the map's static geometry. Signal i is the traffic light map.lights[i].
StaticGeometry make_static_geometry(const RoadMap& map, const MapGeometryOptions& options = {});

/// Returns the walls that `options.wall_seed` selects. The simulator uses the same walls for collisions.
std::vector<WallFace> make_walls(const RoadMap& map, const MapGeometryOptions& options);

}  // namespace pictura
