// Where agents are sent, place by place on their lanes and walkways, drawn again from the seed; and whether one can get
// there.
#pragma once

#include <array>
#include <optional>

#include "pictura/map/lane_graph.h"
#include "pictura/simulator/rules/step.h"

namespace pictura {

/// Where a present agent was placed at the start of its life; it must not have moved yet.
RoutePoint start_place(const WorldView& world, int agent);

/// The waypoints of chain `chain` of the agent's life, which starts at `from`.
std::array<RoutePoint, kNumWaypoints> goal_places(const WorldView& world, int agent, uint32_t chain, RoutePoint from);

/// The place on the graph's lanes, whose lengths differ by rounding from those of the map's rules.
LanePosition lane_place(const MapView& map, const LaneGraph& graph, RoutePoint at);

struct GoalReach {
  int64_t agents = 0, waypoints = 0, unreachable = 0;
};

/// Follows the first `chains` chains of every present agent of a world that has not been stepped yet: vehicles and
/// cyclists (first) and pedestrians (second). A waypoint on a road counts as reached from the one before by a route of
/// the lane graph, which runs on lanes from which a route goes on for ever; one on a walkway, by pieces of walkways
/// that leave the widest pedestrian clear of walls, if none and no parked car stands on it.
std::array<GoalReach, 2> follow_goals(const WorldView& world, const LaneGraph& graph, uint32_t chains);

}  // namespace pictura
