// Waypoints of agents as points on lanes and walkways, and a test whether they can be reached. The waypoints are
// recomputed from the seed, because the state stores only their coordinates.
#pragma once

#include <array>
#include <optional>

#include "pictura/map/lane_graph.h"
#include "pictura/simulator/rules/step.h"

namespace pictura {

/// Returns the point on the lane network (or walkways) at which the agent's life started. The agent must be present and
/// must not have moved yet.
RoutePoint start_place(const WorldView& world, int agent);

/// Returns the waypoints of chain `chain` of the agent's life. The chain starts at `from`.
std::array<RoutePoint, kNumWaypoints> goal_places(const WorldView& world, int agent, uint32_t chain, RoutePoint from);

/// Converts `at` to a position on the lane graph. The graph's lane lengths differ from those of `map` by rounding
/// errors.
LanePosition lane_place(const MapView& map, const LaneGraph& graph, RoutePoint at);

struct GoalReach {
  int64_t agents = 0, waypoints = 0, unreachable = 0;
};

/// Before a world's first step, tests the first `chains` chains of each active agent. Element 0 of the result counts
/// vehicles and cyclists, element 1 pedestrians. A waypoint on a lane is reachable if the lane graph has a route of at
/// most 120 m to it from the previous waypoint. A waypoint on a walkway is reachable if no wall or parked car covers
/// it, and if a pedestrian of maximum size can follow walkways to it without touching a wall.
std::array<GoalReach, 2> follow_goals(const WorldView& world, const LaneGraph& graph, uint32_t chains);

}  // namespace pictura
