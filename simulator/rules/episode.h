// A world's episode: lights, results, counts and end.
#pragma once

#include "pictura/simulator/rules/step.h"
#include "pictura/simulator/totals.h"

namespace pictura {

/// Arrays [slots] of a step's results; see StepResult.
struct StepArrays {
  float* reward = nullptr;
  uint8_t* terminated = nullptr;
  uint8_t* truncated = nullptr;
  uint8_t* valid = nullptr;
  StepSums* sums = nullptr;
};

PICTURA_HD inline void clear_result(const StepArrays& results, int slot) {
  results.reward[slot] = 0.0f;
  results.terminated[slot] = results.truncated[slot] = results.valid[slot] = 0;
  results.sums[slot] = {};
}

/// An agent that takes no actions accepts every command, because it ignores invalid commands. A command to follow a
/// record needs a map with a record.
template <typename CommandType>
PICTURA_HD bool accepts(const WorldView& world, int agent, const CommandType& command) {
  if (!takes_actions(world, agent)) return true;
  return is_valid(command) && (has_record(world.map) || !is_follow_record_command(command));
}

/// Whether a step is counted and used for learning. The agent must obey an action or a kinematic_state command, and be
/// neither impaired nor driven by another policy.
template <typename CommandType>
PICTURA_HD bool is_counted(const WorldView& world, int agent, const CommandType& command) {
  return takes_actions(world, agent) && !is_leave_command(command) && !is_follow_record_command(command) &&
         driver_kind_of(world, agent) == 0;
}

/// Whether the agent counts as active in episode_ends(). Waiting agents do. On a map with a record but no replayed
/// tracks, absent agents count too, because they may appear later.
PICTURA_HD inline bool keeps_episode(const WorldView& world, int agent) {
  const auto status = world.agents.status[world.first_slot + agent];
  if (has_replayed_tracks(world.map)) return takes_actions(status);
  return takes_actions(status) || status == AgentStatus::waiting ||
         (status == AgentStatus::absent && has_record(world.map));
}

/// Rejected command in one 64-bit word, which a host can read atomically: slot, kind and, for an action, its value.
constexpr int64_t kNoRejection = -1;
PICTURA_HD constexpr int64_t rejected_command(int32_t slot, CommandKind kind, int32_t action) {
  const auto kind_bits = static_cast<int64_t>(static_cast<uint32_t>(kind) < 4 ? static_cast<uint32_t>(kind) : 4u);
  return (kind_bits << 60) | (static_cast<int64_t>(slot) << 32) | static_cast<uint32_t>(action);
}
PICTURA_HD constexpr int64_t rejected_command(int32_t slot, int32_t action) {
  return rejected_command(slot, CommandKind::action, action);
}
PICTURA_HD constexpr int64_t rejected_command(int32_t slot, const Command& command) {
  return rejected_command(slot, command.kind, command.kind == CommandKind::action ? command.action : 0);
}

/// Draws a light plan for the episode and sets its first state.
PICTURA_HD inline void begin_light(const WorldView& world, int light) {
  world.light_plans[light] =
      draw_light_plan(world.map.stop_lines[light], light, world.options.light_cycles, world.options.fixed_lights,
                      world.options.dt_s, world.seed, world.global_world, world.episode);
  world.lights[light] = light_state(world.map, light, world.light_plans[light], 0);
}

PICTURA_HD inline void count_events(int events, SimulatorTotals* totals_inout){
#define X(name, logged, counted) totals_inout->name += (events & (counted)) != 0;
    PICTURA_EVENT_TOTALS(X)
#undef X
}

/// Phase 3 (step.h) of an agent in step `step` of the episode, counted from 1.
PICTURA_HD inline void apply_reward_and_halt(const WorldView& world, int agent, int step, const StepArrays& results) {
  const int slot = world.first_slot + agent;
  const float speed_mps = world.agents.speed_mps[slot];
  const bool is_other = driver_kind_of(world, agent) != 0;
  const bool drives = results.valid[slot] || is_other;
  int32_t& first_motion_step = world.agents.first_motion_step[slot];
  if (drives && first_motion_step == 0 && fabsf(speed_mps) > kRest_mps) first_motion_step = step;
  const float distance_m = results.valid[slot] ? driven_m(speed_mps, world.options.dt_s) : 0.0f;
  StepSums sums{distance_m, apply_reward_and_halt(world, agent)};
  if (is_other) sums = {};  // impaired agents and other policies do not count
  results.sums[slot] = sums;
  results.reward[slot] = sums.reward_terms.total();
  results.terminated[slot] = results.valid[slot] && !is_active(world, agent) && !has_left(world, agent);
}

/// Counts an agent's step after phase 3.
PICTURA_HD inline void count_agent(const WorldView& world, int agent, const StepArrays& results,
                                   SimulatorTotals* totals_inout) {
  const int slot = world.first_slot + agent;
  if (!results.valid[slot]) return;
  const StepSums sums = results.sums[slot];
  ++totals_inout->agent_steps;
  totals_inout->reward += static_cast<double>(results.reward[slot]);
#define X(name) totals_inout->reward_terms.name += static_cast<double>(sums.reward_terms.name);
  PICTURA_REWARD_TERMS(X)
#undef X
  totals_inout->distance_m += static_cast<double>(sums.distance_m);
  count_events(world.agents.events[slot], totals_inout);
}

/// Maximum number of steps of the current episode, T = episode_steps. With stagger_episodes, the first episode draws it
/// from U{64, ..., T}, so that worlds do not end episodes together. Later ones have U{T - floor(T / 8), ..., T},
/// because worlds that ended together would otherwise do so again after T steps.
PICTURA_HD inline int max_steps_of(const WorldView& world) {
  constexpr int kMinSteps = 64;
  const int episode_steps = world.options.episode_steps;
  if (!world.options.stagger_episodes || episode_steps <= kMinSteps) return episode_steps;
  RandomStream random(
      {.seed = world.seed, .world = world.global_world, .episode = world.episode, .purpose = Purpose::episode_length});
  const int fewest = world.episode == 0 ? kMinSteps : episode_steps - episode_steps / 8;
  return fewest + random.below(episode_steps - fewest + 1);
}

/// Whether an episode ends after `steps` steps if `active` of its `spawned` agents count as active.
PICTURA_HD inline bool episode_ends(const WorldView& world, int steps, int spawned, int active) {
  if (steps >= max_steps_of(world) || spawned == 0) return true;
  const float inactive = static_cast<float>(spawned - active);
  return inactive >= world.options.reset_inactive_fraction * static_cast<float>(spawned);
}

/// Finishes an agent's step. `ends`: the episode ends with this step. Sets `truncated` for agents that are active at
/// the episode's end or have left. Counts finished episodes and lives.
PICTURA_HD inline void finish_agent(const WorldView& world, int agent, bool ends, const StepArrays& results,
                                    SimulatorTotals* totals_inout) {
  const int slot = world.first_slot + agent;
  const bool counts = driver_kind_of(world, agent) == 0;
  results.truncated[slot] = counts && ((ends && is_active(world, agent)) || has_left(world, agent));
  if (!results.terminated[slot] && !results.truncated[slot]) return;
  ++totals_inout->finished_agent_episodes;
  totals_inout->finished_return += static_cast<double>(world.agents.episode_return[slot]);
  totals_inout->finished_passed_waypoint += world.agents.waypoints_reached[slot] > 0;
  const int first_motion_step = world.agents.first_motion_step[slot];
  totals_inout->finished_moved += first_motion_step > 0;
  if (first_motion_step == 0) return;
  const int to_motion_steps = first_motion_step - world.agents.life_step[slot];
  totals_inout->finished_first_motion_s += to_motion_steps * static_cast<double>(world.options.dt_s);
}

}  // namespace pictura
