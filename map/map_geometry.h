// What a RoadMap looks like: its markings, edges, crosswalks, stop lines and light heads as a StaticGeometry.
#pragma once

#include "pictura/common/scene.h"
#include "pictura/map/road_map.h"

namespace pictura {

struct MapGeometryOptions {
  bool walls = true;                        // walls along the building lines
  uint64_t wall_seed = 0;                   // which stretches of the building lines stand
  float light_half_angle_rad = kPi / 3.0f;  // half of the angle within which a head is seen (60 degrees)
};

/// The map's looks, with signal i of a head being map.lights[i].
StaticGeometry make_static_geometry(const RoadMap& map, const MapGeometryOptions& options = {});

/// The walls that options.walls and wall_seed give; the simulator collides with the same ones.
std::vector<WallFace> make_walls(const RoadMap& map, const MapGeometryOptions& options);

}  // namespace pictura
