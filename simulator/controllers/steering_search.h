// Search for a plan: actions that keep an agent on the road where its path would leave the road.
#pragma once

#include <cstddef>
#include <vector>

#include "pictura/simulator/controllers/driven_agent.h"
#include "pictura/simulator/controllers/lane_path.h"

namespace pictura {

/// Maximum speed of plans, and steps per search node.
constexpr float kPlannedSpeed_mps = 2;
constexpr size_t kStrideSteps = 4;

struct DrivingPlan {
  std::vector<int32_t> actions;
  bool is_clear = false;  // the plan stays on the road up to the horizon or an exit
};

/// Finds the cheapest plan from the agent's current motion near point `place` of the path. Deviations from the path and
/// driving near the road's edge have a cost. The algorithm is hybrid A* without a heuristic (Dolgov et al., Path
/// planning for autonomous vehicles in unknown semi-structured environments, 2010). Subtracts the used nodes from
/// *nodes_left_inout. Without a clear plan, returns the plan that stays on the road longest.
DrivingPlan search_steering(const DrivenAgent& agent, const std::vector<PathPoint>& path, size_t place,
                            size_t* nodes_left_inout);

}  // namespace pictura
