// Leaving a road that ends: where routes end, and when an agent is out.
#pragma once

#include "pictura/simulator/rules/goal.h"

namespace pictura {

/// Farther than an agent drives in a step.
constexpr float kExitReach_m = 5.0f;

/// Whether a waypoint lies where routes end.
PICTURA_HD inline bool is_at_route_end(const MapView& map, RoutePoint at) {
  return at.s_m >= map.lanes[static_cast<size_t>(at.lane)].route_end_m;
}

/// Whether the way of a front bumper's middle, at height z_m, crosses the exit in the direction of its traffic.
PICTURA_HD inline bool crosses(const Exit& exit, Vec2 before, Vec2 after, float z_m) {
  const Vec2 to = after - exit.middle_m.xy();
  const float along_before = dot(before - exit.middle_m.xy(), exit.direction), along_after = dot(to, exit.direction);
  return along_before < 0.0f && along_after >= 0.0f && fabsf(cross(exit.direction, to)) <= exit.half_width_m &&
         fabsf(exit.middle_m.z - z_m) < kLevel_m;
}

PICTURA_HD inline bool crosses_exit(const MapView& map, Vec2 before, Vec2 after, float z_m) {
  if (map.exits.empty()) return false;
  const Span<const int32_t> exits = items_at(map.exit_cells, after);
  for (size_t i = 0; i < exits.size(); ++i) {
    if (crosses(map.exits[static_cast<size_t>(exits[i])], before, after, z_m)) return true;
  }
  return false;
}

}  // namespace pictura
