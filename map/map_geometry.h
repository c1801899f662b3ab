// The StaticGeometry of a RoadMap: markings, edges, crosswalks, stop lines, walls and light heads.
#pragma once

#include "pictura/common/scene.h"
#include "pictura/map/road_map.h"

namespace pictura {

struct MapGeometryOptions {
  bool walls = true;                        // draw walls along the building lines
  uint64_t wall_seed = 0;                   // selects the pieces of building lines that get walls
  float light_half_angle_rad = kPi / 3.0f;  // half of the angle within which a head is visible (60 degrees)
};

/// The map's static geometry; signal i of a head is map.lights[i].
StaticGeometry make_static_geometry(const RoadMap& map, const MapGeometryOptions& options = {});

/// The walls for `options.wall_seed`; the simulator collides with the same ones.
std::vector<WallFace> make_walls(const RoadMap& map, const MapGeometryOptions& options);

}  // namespace pictura
