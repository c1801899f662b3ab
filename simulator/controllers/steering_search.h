// How to drive where a path cannot be followed without leaving the road: a search over the agent's own motions, which
// swings out before tight curves and keeps clear of kerbs.
#pragma once

#include <cstddef>
#include <vector>

#include "pictura/simulator/controllers/driven_agent.h"
#include "pictura/simulator/controllers/lane_path.h"

namespace pictura {

/// Plans slow down to this speed, and steer one way for so many steps.
constexpr float kPlannedSpeed_mps = 2;
constexpr size_t kStrideSteps = 4;

struct DrivingPlan {
  std::vector<int32_t> actions;  // of the coming steps
  bool is_clear = false;         // as far as plans go, or out by an exit; else only until it leaves the road
};

/// The cheapest way along the path, from the agent's motion now, at point `place`: it strays little from the path and
/// seldom comes near the edge of the road. Hybrid A* without a heuristic (Dolgov et al., Path planning for autonomous
/// vehicles in unknown semi-structured environments, 2010): motions are exact, and of those that are alike one is kept.
/// Takes the nodes that it makes from *nodes_left_inout; without any left, the plan is the farthest way found.
DrivingPlan search_steering(const DrivenAgent& agent, const std::vector<PathPoint>& path, size_t place,
                            size_t* nodes_left_inout);

}  // namespace pictura
