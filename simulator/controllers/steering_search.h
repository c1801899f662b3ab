// Search for a drivable way at places where the agent cannot follow its path without leaving the road. The search over
// the agent's own motions swings out before tight curves and keeps clear of kerbs.
#pragma once

#include <cstddef>
#include <vector>

#include "pictura/simulator/controllers/driven_agent.h"
#include "pictura/simulator/controllers/lane_path.h"

namespace pictura {

/// Speed to which plans slow down, and number of steps with constant steering.
constexpr float kPlannedSpeed_mps = 2;
constexpr size_t kStrideSteps = 4;

struct DrivingPlan {
  std::vector<int32_t> actions;  // actions of the coming steps
  bool is_clear = false;  // clear to the horizon or out through an exit; otherwise it ends where it leaves the road
};

/// Finds the cheapest way along the path from the agent's current motion, at point `place`: with little deviation from
/// the path and seldom near the edge of the road. Hybrid A* without a heuristic (Dolgov et al., Path planning for
/// autonomous vehicles in unknown semi-structured environments, 2010): motions are exact, and one of several similar
/// motions is kept. Subtracts the nodes that it makes from *nodes_left_inout; when none are left, the plan is the
/// farthest way found.
DrivingPlan search_steering(const DrivenAgent& agent, const std::vector<PathPoint>& path, size_t place,
                            size_t* nodes_left_inout);

}  // namespace pictura
