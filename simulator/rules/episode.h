// A world's episode: its lights, what a step returns and counts, and when it ends.
#pragma once

#include "pictura/simulator/rules/step.h"
#include "pictura/simulator/totals.h"

namespace pictura {

/// Where the results of a step go: arrays over all slots, as StepResult names them.
struct StepArrays {
  float* reward = nullptr;
  uint8_t* terminated = nullptr;
  uint8_t* truncated = nullptr;
  uint8_t* valid = nullptr;
};

PICTURA_HD inline void clear_result(const StepArrays& results, int slot) {
  results.reward[slot] = 0.0f;
  results.terminated[slot] = results.truncated[slot] = results.valid[slot] = 0;
}

/// Commands to agents that are not active are ignored.
template <typename CommandType>
PICTURA_HD bool accepts(const WorldView& world, int agent, const CommandType& command) {
  return !is_active(world, agent) || is_sound(command);
}

/// Whether a step is one of the agent's own: it was active before and is not told to leave.
template <typename CommandType>
PICTURA_HD bool takes_part(const WorldView& world, int agent, const CommandType& command) {
  return is_active(world, agent) && !tells_to_leave(command);
}

/// A command that a step refused, in one word that a host reads whole: slot, kind, and the action of an action.
constexpr int64_t kNothingRejected = -1;
PICTURA_HD constexpr int64_t rejected_command(int32_t slot, CommandKind kind, int32_t action) {
  const auto kind_bits = static_cast<int64_t>(static_cast<uint32_t>(kind) < 3 ? static_cast<uint32_t>(kind) : 3u);
  return (kind_bits << 60) | (static_cast<int64_t>(slot) << 32) | static_cast<uint32_t>(action);
}
PICTURA_HD constexpr int64_t rejected_command(int32_t slot, int32_t action) {
  return rejected_command(slot, CommandKind::action, action);
}
PICTURA_HD constexpr int64_t rejected_command(int32_t slot, const Command& command) {
  return rejected_command(slot, command.kind, command.kind == CommandKind::action ? command.action : 0);
}

/// Draws the episode's cycle of one stop line and shows its first state.
PICTURA_HD inline void begin_light(const WorldView& world, int light) {
  world.light_plans[light] =
      draw_light_plan(world.map.stop_lines[static_cast<size_t>(light)], light, world.options.fixed_lights,
                      world.options.dt_s, world.seed, world.global_world, world.episode);
  world.lights[light] = light_state(world.light_plans[light], 0);
}

PICTURA_HD inline void count_events(int events, SimulatorTotals* totals_inout) {
  totals_inout->goals_reached += (events & kEventMetricGoal) != 0;
  totals_inout->waypoints_reached += (events & (kEventWaypoint | kEventGoal)) != 0;
  totals_inout->collisions += (events & kEventCollision) != 0;
  totals_inout->at_fault_collisions += (events & kEventAtFault) != 0;
  totals_inout->off_road += (events & kEventOffRoad) != 0;
  totals_inout->red_light += (events & kEventRedLight) != 0;
  totals_inout->wall_contacts += (events & kEventWall) != 0;
}

/// Phase 3 of one agent, whose reward and end it writes. Returns how far it drove in the step, in metres.
PICTURA_HD inline float apply_reward_and_halt(const WorldView& world, int agent, const StepArrays& results) {
  const int slot = world.first_slot + agent;
  const float step_m = driven_m(world.agents.speed_mps[slot], world.options.dt_s);
  results.reward[slot] = apply_reward_and_halt(world, agent);
  results.terminated[slot] = results.valid[slot] && !is_active(world, agent);
  return step_m;
}

/// Counts the step of an agent after phase 3, in which it drove step_m.
PICTURA_HD inline void count_agent(const WorldView& world, int agent, const StepArrays& results, float step_m,
                                   SimulatorTotals* totals_inout) {
  const int slot = world.first_slot + agent;
  if (!results.valid[slot]) return;
  ++totals_inout->agent_steps;
  totals_inout->reward += static_cast<double>(results.reward[slot]);
  totals_inout->distance_m += static_cast<double>(step_m);
  count_events(world.agents.events[slot], totals_inout);
}

/// After `steps` steps, with `spawned` agents of which `active` still drive: time is up, too many are inactive, or
/// there is nobody.
PICTURA_HD inline bool episode_ends(const RuleOptions& options, int steps, int spawned, int active) {
  if (steps >= options.episode_steps || spawned == 0) return true;
  const float inactive = static_cast<float>(spawned - active);
  return inactive >= options.reset_inactive_fraction * static_cast<float>(spawned);
}

/// Once it is known whether the world's episode ends with this step: cuts off who still drives, and counts whose
/// episode is over.
PICTURA_HD inline void finish_agent(const WorldView& world, int agent, bool ends, const StepArrays& results,
                                    SimulatorTotals* totals_inout) {
  const int slot = world.first_slot + agent;
  results.truncated[slot] = ends && is_active(world, agent);
  if (!results.terminated[slot] && !results.truncated[slot]) return;
  ++totals_inout->finished_agent_episodes;
  totals_inout->finished_return += static_cast<double>(world.agents.episode_return[slot]);
}

}  // namespace pictura
