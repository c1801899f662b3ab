// Waypoints of agents, recomputed from the seed, and their reachability.
#pragma once

#include <array>
#include <optional>

#include "pictura/map/lane_graph.h"
#include "pictura/simulator/rules/step.h"

namespace pictura {

/// Returns where the agent's life started. The agent must be present and must not have moved yet.
RoutePoint start_place(const WorldView& world, int agent);

/// Returns the waypoints of a goal chain that starts at `from`.
std::array<RoutePoint, kNumWaypoints> goal_places(const WorldView& world, int agent, uint32_t chain, RoutePoint from);

/// Converts `at` to a position on the lane graph.
LanePosition lane_place(const MapView& map, const LaneGraph& graph, RoutePoint at);

struct GoalReach {
  int64_t agents = 0, waypoints = 0, unreachable = 0;
};

/// Tests the first `chains` goal chains of each active agent before a world's first step. Element 0 of the result
/// counts vehicles and cyclists, element 1 pedestrians. A waypoint on a lane is reachable by a route of at most 120 m
/// from the previous waypoint. A waypoint on a walkway is reachable if no wall or parked car covers it, and if a
/// pedestrian of maximum size can walk there without touching a wall.
std::array<GoalReach, 2> follow_goals(const WorldView& world, const LaneGraph& graph, uint32_t chains);

}  // namespace pictura
