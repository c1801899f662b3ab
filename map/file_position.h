// Conversion to the coordinates of a map's file, for reports, events and tables.
#pragma once

#include <array>

#include "pictura/common/math.h"

namespace pictura {

/// `origin_m` is RoadMap::origin_m.
inline std::array<double, 3> file_position_m(const std::array<double, 3>& origin_m, Vec3 point_m) {
  return {static_cast<double>(point_m.x) + origin_m[0], static_cast<double>(point_m.y) + origin_m[1],
          static_cast<double>(point_m.z) + origin_m[2]};
}

}  // namespace pictura
