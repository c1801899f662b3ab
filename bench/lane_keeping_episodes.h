// Whole episodes driven by the lane-keeping controller, which show that a map can be driven.
#pragma once

#include <memory>
#include <vector>

#include "pictura/simulator/simulator.h"

namespace pictura {

/// What became of a lane-keeping agent.
struct DrivenEpisode {
  int goals = 0;  // last waypoints passed within 2 m
  int halt_reason = kEventNone;
  int stops = 0, steps_astray = 0;
  float distance_m = 0;
  Vec2 end_m;
};

/// Drives for `steps` steps, or until an infraction, in so many worlds on the map, so many agents in each among parked
/// cars, from the first episode of config.seed on. The share of cyclists is config.cyclist_fraction; the rest is as in
/// evaluation: waypoints of 2 m, lights with fixed timing, no multipliers.
std::vector<DrivenEpisode> drive_lane_keeping_episodes(const std::shared_ptr<const RoadMap>& map,
                                                       SimulatorConfig config, int num_worlds, int drivers_each,
                                                       int steps);

}  // namespace pictura
