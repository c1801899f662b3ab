// Makes a map's StaticGeometry, which is drawn: marks, road edges, crosswalks, stop lines, walls and light heads.
#pragma once

#include <array>
#include <string>

#include "pictura/common/error_types.h"
#include "pictura/common/scene.h"
#include "pictura/map/road_map.h"

namespace pictura {

/// Placement of light heads. `visible` moves heads that are less than kVisibleHeadAhead_m beyond the middle of their
/// stop line. They move ahead to this distance, and to a height of kVisibleHeadHeight_m above the road. So a vehicle
/// that waits at the line sees the head.
enum class LightHeads : uint8_t { as_mapped, visible };
constexpr std::array<const char*, 2> kLightHeadsNames{"as_mapped", "visible"};
constexpr float kVisibleHeadAhead_m = 10.0f, kVisibleHeadHeight_m = 3.5f;

/// Throws UsageError, which lists the valid names, for other names.
LightHeads light_heads_named(const std::string& name);
std::string name_of(LightHeads heads);

struct MapGeometryOptions {
  bool walls = true;
  uint64_t wall_seed = 0;                   // selects the pieces of building lines that have walls
  float light_half_angle_rad = kPi / 3.0f;  // half of the angle within which a head is visible
  LightHeads light_heads = LightHeads::as_mapped;
};

/// Signal i of the result is map.lights[i].
StaticGeometry make_static_geometry(const RoadMap& map, const MapGeometryOptions& options = {});

/// Returns the walls that `options.wall_seed` selects, for drawing and for collisions.
std::vector<WallFace> make_walls(const RoadMap& map, const MapGeometryOptions& options);

}  // namespace pictura
