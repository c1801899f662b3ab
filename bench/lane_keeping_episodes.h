// Episodes of the lane-keeping controller, which show whether agents can drive on a map.
#pragma once

#include <memory>
#include <vector>

#include "pictura/simulator/simulator.h"

namespace pictura {

struct DrivenEpisode {
  int goals = 0;  // goals (last waypoints) passed within 2 m
  int halt_reason = kEventNone;
  int stops = 0, steps_off_path = 0;
  float distance_m = 0;
  Vec2 end_m;
};

/// Drives num_worlds worlds of drivers_each agents among parked cars for `steps` steps. An agent is halted at its first
/// infraction. As in evaluations, waypoints are passed within 2 m, lights have fixed timing, and the multipliers of
/// dynamics are 1.
std::vector<DrivenEpisode> drive_lane_keeping_episodes(const std::shared_ptr<const RoadMap>& map,
                                                       SimulatorConfig config, int num_worlds, int drivers_each,
                                                       int steps);

}  // namespace pictura
