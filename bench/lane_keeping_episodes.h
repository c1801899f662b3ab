// Whole episodes driven by the lane-keeping controller, which demonstrate that a map is drivable.
#pragma once

#include <memory>
#include <vector>

#include "pictura/simulator/simulator.h"

namespace pictura {

/// Outcome of a lane-keeping agent's episode.
struct DrivenEpisode {
  int goals = 0;  // last waypoints passed within 2 m
  int halt_reason = kEventNone;
  int stops = 0, steps_off_path = 0;
  float distance_m = 0;
  Vec2 end_m;
};

/// Drives for `steps` steps, or until an infraction, in num_worlds worlds on the map with drivers_each agents among
/// parked cars, from the first episode of config.seed on. The share of cyclists is config.cyclist_fraction. Everything
/// else is as in evaluation: waypoints of 2 m, lights with fixed timing, no multipliers.
std::vector<DrivenEpisode> drive_lane_keeping_episodes(const std::shared_ptr<const RoadMap>& map,
                                                       SimulatorConfig config, int num_worlds, int drivers_each,
                                                       int steps);

}  // namespace pictura
