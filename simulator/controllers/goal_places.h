// Goals of agents, place by place on their lanes and walkways, redrawn from the seed, and whether they can be reached.
#pragma once

#include <array>
#include <optional>

#include "pictura/map/lane_graph.h"
#include "pictura/simulator/rules/step.h"

namespace pictura {

/// Returns the place of an agent at the start of its life; the agent must be present and not have moved yet.
RoutePoint start_place(const WorldView& world, int agent);

/// Returns the waypoints of chain `chain` of the agent's life, which starts at `from`.
std::array<RoutePoint, kNumWaypoints> goal_places(const WorldView& world, int agent, uint32_t chain, RoutePoint from);

/// Converts `at` to a place on the graph's lanes, whose lengths differ by rounding from those of the map's rules.
LanePosition lane_place(const MapView& map, const LaneGraph& graph, RoutePoint at);

struct GoalReach {
  int64_t agents = 0, waypoints = 0, unreachable = 0;
};

/// Follows the first `chains` chains of every present agent of a world before its first step: vehicles and cyclists
/// (first) and pedestrians (second). A waypoint on a road counts as reached if the lane graph has a route to it from
/// the previous waypoint, along lanes on which endless routes start. A waypoint on a walkway counts as reached if
/// pieces of walkways lead to it, with the widest pedestrian clear of walls, and no wall or parked car covers it.
std::array<GoalReach, 2> follow_goals(const WorldView& world, const LaneGraph& graph, uint32_t chains);

}  // namespace pictura
