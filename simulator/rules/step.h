// One step of an agent, in three phases: (1) motion, road, lights and goals; (2) collisions; (3) reward and halt. All
// agents of a world finish phase 1 before any agent begins phase 2.
#pragma once

#include "pictura/simulator/command.h"
#include "pictura/simulator/rules/collision.h"
#include "pictura/simulator/rules/exit.h"
#include "pictura/simulator/rules/reward.h"
#include "pictura/simulator/rules/spawn.h"

namespace pictura {

PICTURA_HD inline bool is_active(const WorldView& world, int agent) {
  return world.agents.status[world.first_slot + agent] == AgentStatus::active;
}

PICTURA_HD inline bool takes_actions(const WorldView& world, int agent) {
  return takes_actions(world.agents.status[world.first_slot + agent]);
}

/// Whether the agent left an open map in the last step.
PICTURA_HD inline bool has_left(const WorldView& world, int agent) {
  return world.map.is_open && world.agents.left[world.first_slot + agent] != 0;
}

PICTURA_HD inline bool runs_red_light(const WorldView& world, const AgentBox& before, const AgentBox& after,
                                      int32_t lane_before, int32_t lane_after) {
  const Crossing crossing{front_bumper(before), front_bumper(after), {after.cos_heading, after.sin_heading},
                          after.center_m.z,     lane_before,         lane_after};
  const Span<const int32_t> lights = items_at(world.map.stop_line_cells, crossing.bumper_after);
  for (size_t i = 0; i < lights.size(); ++i) {
    const int32_t light = lights[i];
    if (violates(world.map, light, crossing, world.lights[light])) return true;
  }
  return false;
}

PICTURA_HD inline Vec3 waypoint_of(const AgentStateView& agents, int slot, int index) {
  const int i = slot * kNumWaypoints + index;
  return {agents.waypoint_x_m[i], agents.waypoint_y_m[i], agents.waypoint_z_m[i]};
}

/// Additional event bit, stored in the field `left`, because `events` has only 8 bits.
constexpr int kLeaves = 256;

/// Whether the agent's route ends at its last waypoint.
PICTURA_HD inline bool ends_way(const WorldView& world, int agent) {
  const int slot = world.first_slot + agent;
  return world.map.is_open && !walks(world, agent) &&
         is_at_route_end(world.map, {world.agents.goal_lane[slot], world.agents.goal_lane_s_m[slot]});
}

/// Returns the event bits of waypoints that the motion passes. A chain's last waypoint becomes the goal of the metric
/// Goals when it becomes the agent's next waypoint. It remains the goal until the agent passes it within
/// kMetricGoalRadius_m, or until the next chain's last waypoint replaces it. The reward may accept a larger distance,
/// so an agent can pass the waypoint for the reward first and for the metric later.
template <typename ThreadGroup>
PICTURA_HD int pass_waypoints(const WorldView& world, int agent, Vec3 from, Vec3 to, const ThreadGroup& group) {
  const AgentStateView& agents = world.agents;
  const int slot = world.first_slot + agent;
  const bool is_writer = group.rank() == 0;
  const bool reaches_goal =
      agents.goal_open[slot] &&
      passes(from, to, {agents.goal_x_m[slot], agents.goal_y_m[slot], agents.goal_z_m[slot]}, kMetricGoalRadius_m);
  const int index = agents.next_waypoint[slot];
  const float radius_m = agents.conditioning[slot * kNumConditioning + static_cast<int>(Conditioning::delta_goal_m)];
  const bool has_waypoint = !has_record(world.map) || agents.goal_chains[slot] < kRecordedGoalReached;
  const bool passes_waypoint = has_waypoint && passes(from, to, waypoint_of(agents, slot, index), radius_m);
  group.sync();
  if (is_writer && reaches_goal) {
    agents.goal_open[slot] = 0;
    ++agents.goals_reached[slot];
  }
  const int events = reaches_goal ? kEventMetricGoal : kEventNone;
  if (!passes_waypoint) return events;
  if (is_writer) ++agents.waypoints_reached[slot];
  if (index + 1 == kNumWaypoints) {
    if (ends_way(world, agent)) return events | kEventGoal | kLeaves;
    draw_goal_chain(world, agent, group);
    return events | kEventGoal;
  }
  if (!is_writer) return events | kEventWaypoint;
  agents.next_waypoint[slot] = index + 1;
  if (index + 2 == kNumWaypoints) {
    const Vec3 goal = waypoint_of(agents, slot, index + 1);
    agents.goal_x_m[slot] = goal.x;
    agents.goal_y_m[slot] = goal.y;
    agents.goal_z_m[slot] = goal.z;
    agents.goal_open[slot] = 1;
  }
  return events | kEventWaypoint;
}

PICTURA_HD inline DynamicsParameters dynamics_of(const WorldView& world, int slot) {
  const AgentStateView& agents = world.agents;
  const float* conditioning = agents.conditioning + slot * kNumConditioning;
  DynamicsParameters parameters;
  parameters.rules = world.options.dynamics;
  parameters.throttle = conditioning[static_cast<int>(Conditioning::throttle)];
  parameters.steer = conditioning[static_cast<int>(Conditioning::steer)];
  parameters.acceleration = conditioning[static_cast<int>(Conditioning::acceleration)];
  parameters.wheelbase_m = kWheelbasePerLength * agents.length_m[slot];
  return parameters;
}

/// See command.h.
PICTURA_HD inline bool is_valid(int32_t action) { return action >= 0 && action < kNumActions; }
PICTURA_HD inline bool is_valid(const Command& command) {
  switch (command.kind) {
    case CommandKind::action: return is_valid(command.action);
    case CommandKind::kinematic_state:  // comparisons are false for NaN
      return fabsf(command.x_m) <= kMaxCommanded_m && fabsf(command.y_m) <= kMaxCommanded_m &&
             fabsf(command.z_m) <= kMaxCommanded_m && fabsf(command.heading_rad) <= kMaxCommanded_rad &&
             fabsf(command.speed_mps) <= kMaxCommanded_mps;
    case CommandKind::absent:
    case CommandKind::recorded: return true;
    default: return false;
  }
}

PICTURA_HD constexpr bool is_leave_command(int32_t) { return false; }
PICTURA_HD inline bool is_leave_command(const Command& command) { return command.kind == CommandKind::absent; }
PICTURA_HD constexpr bool is_follow_record_command(int32_t) { return false; }
PICTURA_HD inline bool is_follow_record_command(const Command& command) {
  return command.kind == CommandKind::recorded;
}

PICTURA_HD inline bool may_follow_record(const WorldView& world, int agent) {
  return has_record(world.map) && world.agents.status[world.first_slot + agent] != AgentStatus::halted;
}

/// *z_m_inout is the height near which the road is searched; a kinematic_state command replaces it.
PICTURA_HD inline Motion commanded_motion(const WorldView& world, int agent, int32_t action, float*) {
  const int slot = world.first_slot + agent;
  const Motion from = motion_of(world.agents, slot);
  Controls controls = controls_of_action(action);
  DynamicsParameters parameters = dynamics_of(world, slot);
  if (active_impairment(world, agent) == Impairment::phantom_braking) {
    controls.jerk_long_mps3 = braking_jerk_mps3(from);
    parameters.rules.reset_at_standstill = true;  // otherwise the agent would reverse
  }
  return move(from, controls, parameters, class_limits(world.agents.agent_class[slot]), world.options.dt_s);
}
PICTURA_HD inline Motion commanded_motion(const WorldView& world, int agent, const Command& command, float* z_m_inout) {
  if (command.kind == CommandKind::action) return commanded_motion(world, agent, command.action, z_m_inout);
  Motion motion;
  motion.x_m = command.x_m;
  motion.y_m = command.y_m;
  motion.heading_rad = wrap_angle(command.heading_rad);
  motion.speed_mps = command.speed_mps;
  *z_m_inout = command.z_m;
  return motion;
}

/// Phase 1 of step `step` of the episode, counted from 1. Only the first thread of the group writes, after all threads
/// have read.
template <typename CommandType, typename ThreadGroup = SingleThread>
PICTURA_HD void advance(const WorldView& world, int agent, const CommandType& command, int step,
                        const ThreadGroup& group = {}) {
  const AgentStateView& agents = world.agents;
  const int slot = world.first_slot + agent;
  const AgentBox before = world.boxes[agent];
  const bool is_recorded = agents.status[slot] == AgentStatus::recorded;
  if (is_follow_record_command(command) && may_follow_record(world, agent)) {
    return follow_record(world, agent, step, group);
  }
  if (!takes_actions(world, agent)) {
    if (group.rank() > 0) return;
    if (world.map.is_open) agents.left[slot] = 0;
    // The box of an agent that left in the last step is still visible.
    const bool is_gone = !has_body(agents.status[slot]) && before.drawn;
    if (is_gone) return remove_box(world, agent);
    world.boxes_before[agent] = before;
    agents.events[slot] = kEventNone;
    return;
  }

  if (is_leave_command(command)) {
    group.sync();
    if (group.rank() == 0) leave(world, agent);
    return;
  }

  const AgentClass agent_class = agents.agent_class[slot];
  const Vec3 from{agents.x_m[slot], agents.y_m[slot], agents.z_m[slot]};
  float level_m = from.z;
  const Motion motion = commanded_motion(world, agent, command, &level_m);
  const int32_t lane_before = agents.lane[slot];
  const LaneFit fit =
      fit_agent(world, agent, {motion.x_m, motion.y_m}, level_m, motion.heading_rad, lane_before, group);
  const SinCos heading = sincos_of(motion.heading_rad);
  const AgentBox box = box_at(agents, slot, {motion.x_m, motion.y_m, fit.z_m}, heading);

  int events = kEventNone;
  const OrientedBox print = footprint(box);
  if (touches_any(print, box.center_m.z, world.map.walls, world.map.wall_cells, group)) events |= kEventWall;
  if (agent_class != AgentClass::pedestrian) {
    if (touches_any(print, box.center_m.z, world.map.edges, world.map.edge_cells, group) ||
        !is_on_road(world.map, print.center_m, box.center_m.z, group)) {
      events |= kEventOffRoad;
    }
    if (runs_red_light(world, before, box, lane_before, fit.lane)) events |= kEventRedLight;
    if (crosses_exit(world.map, before, box)) events |= kLeaves;
  }
  events |= pass_waypoints(world, agent, from, {motion.x_m, motion.y_m, fit.z_m}, group);
  if (group.rank() > 0) return;
  if (is_recorded) agents.status[slot] = AgentStatus::active;
  agents.distance_m[slot] += driven_m(motion.speed_mps, world.options.dt_s);
  world.boxes_before[agent] = before;
  world.boxes[agent] = box;
  store_motion(agents, slot, motion, heading);
  store_fit(agents, slot, fit);
  agents.events[slot] = static_cast<uint8_t>(events & ~kLeaves);
  if (world.map.is_open) agents.left[slot] = (events & kLeaves) != 0;
}

/// Phase 2 of an active agent.
template <typename ThreadGroup = SingleThread>
PICTURA_HD void find_collisions(const WorldView& world, int agent, const ThreadGroup& group = {}) {
  if (!is_active(world, agent)) return;
  const AgentBox& own = world.boxes[agent];
  const AgentBox& own_before = world.boxes_before[agent];
  const GridView& cells = world.box_cells;
  const int slot = world.first_slot + agent;
  const float own_reach =
      radius(own) + world.map.max_box_radius_m + 2.0f * world.map.max_speed_mps * world.options.dt_s;
  const CellRows range = cells_around(cells, own.center_m.xy(), own_reach);
  bool collides = false, is_at_fault = false;
  for (int y = range.y0; y <= range.y1; ++y) {
    const int32_t end = range.end(cells, y);
    for (int32_t i = range.begin(cells, y) + group.rank(); i < end; i += group.size()) {
      const Vec2 apart = world.cell_centers[i] - own.center_m.xy();
      if (dot(apart, apart) > square(own_reach)) continue;
      const int32_t other = cells.items[i];
      if (other == agent || !collide(own_before, own, world.boxes_before[other], world.boxes[other])) continue;
      collides = true;
      is_at_fault = is_at_fault || at_fault(own_before, world.agents.speed_mps[slot], world.boxes_before[other]);
    }
  }
  collides = group.any(collides);
  is_at_fault = group.any(is_at_fault);
  if (group.rank() > 0 || !collides) return;
  uint8_t& events = world.agents.events[slot];
  events = static_cast<uint8_t>(events | kEventCollision | (is_at_fault ? kEventAtFault : kEventNone));
}

/// `motion` is the motion before an infraction halts the agent.
PICTURA_HD inline StepFacts step_facts(const Motion& motion, const LaneFit& fit, int events) {
  StepFacts facts;
  facts.motion = motion;
  facts.fit = fit;
  facts.passed_waypoint = (events & kEventWaypoint) != 0;
  facts.passed_last_waypoint = (events & kEventGoal) != 0;
  facts.collision = (events & kEventCollision) != 0;
  facts.off_road = (events & (kEventOffRoad | kEventWall)) != 0;
  facts.red_light = (events & kEventRedLight) != 0;
  return facts;
}

/// Phase 3 of an active agent: applies options.after_infraction and returns the reward terms. The agent also leaves at
/// its goal (options.leave_at_goal) or where its road ends. Its box then remains visible until the next step, but takes
/// no part in that step's collisions. Phase 2 of other agents reads no data that this phase writes.
PICTURA_HD inline RewardTerms apply_reward_and_halt(const WorldView& world, int agent) {
  if (!is_active(world, agent)) return {};
  const AgentStateView& agents = world.agents;
  const int slot = world.first_slot + agent;
  const int events = agents.events[slot];
  const StepFacts facts = step_facts(motion_of(agents, slot), fit_of(agents, slot), events);
  const RewardTerms terms = reward_terms(facts, agents.conditioning + slot * kNumConditioning, world.options.dt_s);
  agents.episode_return[slot] += terms.total();
  agents.episode_events[slot] = static_cast<uint8_t>(agents.episode_events[slot] | events);

  const int infractions = events & kInfractions;
  const AfterInfraction after = world.options.after_infraction;
  if (infractions != 0 && after != AfterInfraction::drive_on) {
    agents.halt_reason[slot] = static_cast<uint8_t>(infractions);
  }
  const bool arrives = world.options.leave_at_goal && (events & kEventMetricGoal) != 0;
  const bool is_out = arrives || (infractions != 0 && after == AfterInfraction::leave);
  const bool halts = infractions != 0 && after == AfterInfraction::halt;
  if (has_left(world, agent)) {
    agents.left[slot] = !is_out && !halts;
    if (agents.left[slot]) agents.status[slot] = AgentStatus::waiting;
  }
  if (is_out) agents.status[slot] = AgentStatus::absent;
  if (is_out || !halts) return terms;
  agents.status[slot] = AgentStatus::halted;
  agents.speed_mps[slot] = agents.accel_long_mps2[slot] = agents.accel_lat_mps2[slot] = 0.0f;
  agents.steer_rad[slot] = agents.jerk_long_mps3[slot] = agents.jerk_lat_mps3[slot] = 0.0f;
  world.boxes[agent].palette = kHaltedPalette;
  return terms;
}

}  // namespace pictura
