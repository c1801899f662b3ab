// Junctions and traffic lights of an OpenDRIVE network.
#include "pictura/map/opendrive_build.h"

namespace pictura::opendrive {

void build_lights(Build* build) {
  for (const FileJunction& junction : build->network.junctions) build->map->junctions.push_back({junction.id, 0});
}

void build_building_lines(Build*) {}

}  // namespace pictura::opendrive
