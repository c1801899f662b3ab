// What a simulator counts. Sums of floating-point numbers have one order on every executor: agent i of a world adds to
// lane i mod kTotalsLanes, and the lanes are added up in order.
#pragma once

#include "pictura/common/hd.h"

namespace pictura {

constexpr int kTotalsLanes = 32;

/// Totals since construction; counts are of controlled agents.
struct SimulatorTotals {
  int64_t agent_steps = 0;  // active agents advanced by one step
  int64_t slot_steps = 0;   // slots times steps
  int64_t episodes = 0;     // worlds reset after their first episode
  int64_t goals_reached = 0, waypoints_reached = 0;
  int64_t collisions = 0, at_fault_collisions = 0, off_road = 0, red_light = 0, wall_contacts = 0;
  double distance_m = 0;
  double reward = 0;
  int64_t finished_agent_episodes = 0;  // agents whose episode ended
  double finished_return = 0;           // sum of their returns

  PICTURA_HD void add(const SimulatorTotals& part) {
    agent_steps += part.agent_steps;
    slot_steps += part.slot_steps;
    episodes += part.episodes;
    goals_reached += part.goals_reached;
    waypoints_reached += part.waypoints_reached;
    collisions += part.collisions;
    at_fault_collisions += part.at_fault_collisions;
    off_road += part.off_road;
    red_light += part.red_light;
    wall_contacts += part.wall_contacts;
    distance_m += part.distance_m;
    reward += part.reward;
    finished_agent_episodes += part.finished_agent_episodes;
    finished_return += part.finished_return;
  }
};

}  // namespace pictura
