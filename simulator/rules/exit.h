// Exit from open maps.
#pragma once

#include "pictura/simulator/rules/collision.h"
#include "pictura/simulator/rules/goal.h"
#include "pictura/simulator/rules/limits.h"

namespace pictura {

/// Upper bound on an agent's motion in a step.
constexpr float kExitReach_m = 5.0f;

PICTURA_HD inline bool is_at_route_end(const MapView& map, RoutePoint at) {
  return at.s_m >= map.lanes[at.lane].route_end_m;
}

/// Whether the middle of the front bumper crosses the exit in the direction of traffic.
PICTURA_HD inline bool crosses(const Exit& exit, const AgentBox& before, const AgentBox& after) {
  const Vec2 from = front_bumper(before) - exit.middle_m.xy(), to = front_bumper(after) - exit.middle_m.xy();
  const float bumper_z_m = after.center_m.z + exit.slope * reference_to_bumper(after.agent_class, after.length_m);
  return dot(from, exit.direction) < 0.0f && dot(to, exit.direction) >= 0.0f &&
         fabsf(cross(exit.direction, to)) <= exit.half_width_m && fabsf(exit.middle_m.z - bumper_z_m) < kLevel_m;
}

PICTURA_HD inline bool crosses_exit(const MapView& map, const AgentBox& before, const AgentBox& after) {
  if (map.exits.empty()) return false;
  const Span<const int32_t> exits = items_at(map.exit_cells, front_bumper(after));
  for (size_t i = 0; i < exits.size(); ++i) {
    if (crosses(map.exits[static_cast<size_t>(exits[i])], before, after)) return true;
  }
  return false;
}

}  // namespace pictura
