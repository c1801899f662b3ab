// Whole episodes that the lane-keeping controller drives. They show whether agents can drive on a map.
#pragma once

#include <memory>
#include <vector>

#include "pictura/simulator/simulator.h"

namespace pictura {

/// Outcome of a lane-keeping agent's episode.
struct DrivenEpisode {
  int goals = 0;  // number of goals (the last of three waypoints) passed within 2 m
  int halt_reason = kEventNone;
  int stops = 0, steps_off_path = 0;
  float distance_m = 0;
  Vec2 end_m;
};

/// Drives for `steps` steps in num_worlds worlds on the map, each with drivers_each agents among parked cars. An agent
/// is halted at its first infraction. The worlds begin with the first episode of config.seed, and
/// config.cyclist_fraction of the agents are cyclists. Everything else is as in evaluations: waypoints are passed
/// within 2 m, lights have fixed timing, and the multipliers of dynamics are 1.
std::vector<DrivenEpisode> drive_lane_keeping_episodes(const std::shared_ptr<const RoadMap>& map,
                                                       SimulatorConfig config, int num_worlds, int drivers_each,
                                                       int steps);

}  // namespace pictura
