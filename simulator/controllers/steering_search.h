// Search for a plan: a sequence of actions that keeps an agent on the road where it would leave the road by following
// its path. Because the search simulates the agent's motion, plans can swing out before tight curves and avoid kerbs.
#pragma once

#include <cstddef>
#include <vector>

#include "pictura/simulator/controllers/driven_agent.h"
#include "pictura/simulator/controllers/lane_path.h"

namespace pictura {

/// Maximum speed of plans, and number of steps per search node.
constexpr float kPlannedSpeed_mps = 2;
constexpr size_t kStrideSteps = 4;

struct DrivingPlan {
  std::vector<int32_t> actions;  // actions of the coming steps
  bool is_clear = false;         // the plan stays on the road up to the horizon or an exit
};

/// Finds the cheapest plan along the path, from the agent's current motion near point `place`. Deviations from the path
/// and driving near the edge of the road have a cost. The algorithm is hybrid A* without a heuristic (Dolgov et al.,
/// Path planning for autonomous vehicles in unknown semi-structured environments, 2010): motions are exact, and of
/// several similar motions only one is kept. *nodes_left_inout is the budget of nodes; the search subtracts the number
/// of nodes that it used. If no clear plan is found, the result is the plan that stays on the road longest.
DrivingPlan search_steering(const DrivenAgent& agent, const std::vector<PathPoint>& path, size_t place,
                            size_t* nodes_left_inout);

}  // namespace pictura
