// Agents that follow the records of a recorded scene.
#pragma once

#include "pictura/simulator/rules/walk.h"
#include "pictura/simulator/rules/world_view.h"

namespace pictura {

/// Values of goal_chains on maps with a record, where an agent has only one goal.
constexpr int32_t kRecordedGoal = 1, kRecordedGoalReached = 2;

/// Returns the state `step` steps after the episode's start. After the record's end, it is the last state, but with its
/// speed set to 0.
PICTURA_HD inline RecordedState recorded_state(const MapView& map, int agent, int step) {
  const int last = map.recorded_steps - 1;
  RecordedState state = map.recorded_states[static_cast<size_t>(agent) * static_cast<size_t>(map.recorded_steps) +
                                            static_cast<size_t>(min_of(step, last))];
  if (step > last) state.speed_mps = 0.0f;
  return state;
}

PICTURA_HD inline void store_recorded_size(const WorldView& world, int agent) {
  const RecordedAgent& recorded = world.map.recorded_agents[agent];
  const int slot = world.first_slot + agent;
  world.agents.length_m[slot] = recorded.length_m;
  world.agents.width_m[slot] = recorded.width_m;
  world.agents.height_m[slot] = recorded.height_m;
}

PICTURA_HD inline bool walks(const WorldView& world, int agent) {
  return world.agents.agent_class[world.first_slot + agent] == AgentClass::pedestrian;
}

template <typename ThreadGroup>
PICTURA_HD LaneFit fit_class(const MapView& map, AgentClass agent_class, Vec2 p, float z_m, float heading_rad,
                             int32_t current_lane, const ThreadGroup& group) {
  return agent_class == AgentClass::pedestrian ? fit_walk(map, p, z_m, heading_rad, current_lane, group)
                                               : fit_lane(map, p, z_m, heading_rad, current_lane, group);
}

template <typename ThreadGroup>
PICTURA_HD LaneFit fit_agent(const WorldView& world, int agent, Vec2 p, float z_m, float heading_rad,
                             int32_t current_lane, const ThreadGroup& group) {
  return fit_class(world.map, world.agents.agent_class[world.first_slot + agent], p, z_m, heading_rad, current_lane,
                   group);
}

/// Removes the box of an agent without a body.
PICTURA_HD inline void remove_box(const WorldView& world, int agent) {
  const int slot = world.first_slot + agent;
  world.agents.events[slot] = kEventNone;
  world.boxes[agent] = world.boxes_before[agent] = box_of(world.agents, slot);
}

PICTURA_HD inline void leave(const WorldView& world, int agent) {
  world.agents.status[world.first_slot + agent] = AgentStatus::absent;
  remove_box(world, agent);
}

/// Places an agent at its recorded state `step` steps after the episode's start, or removes it if there is no such
/// state. If the agent did not follow its record in the step before, the way to the recorded state is not tested for
/// collisions. Only the first thread of the group writes.
template <typename ThreadGroup>
PICTURA_HD void follow_record(const WorldView& world, int agent, int step, const ThreadGroup& group) {
  const AgentStateView& agents = world.agents;
  const int slot = world.first_slot + agent;
  const RecordedState at = recorded_state(world.map, agent, step);
  const bool goes_on = agents.status[slot] == AgentStatus::recorded;
  const int32_t lane_before = goes_on ? agents.lane[slot] : -1;
  const AgentBox before = world.boxes[agent];
  if (!at.is_present) {
    group.sync();
    if (group.rank() == 0) leave(world, agent);
    return;
  }
  const LaneFit fit = fit_agent(world, agent, at.position_m.xy(), at.position_m.z, at.heading_rad, lane_before, group);
  group.sync();
  if (group.rank() > 0) return;
  Motion motion;
  motion.x_m = at.position_m.x;
  motion.y_m = at.position_m.y;
  motion.heading_rad = at.heading_rad;
  motion.speed_mps = at.speed_mps;
  store_motion(agents, slot, motion);
  store_fit(agents, slot, fit);
  agents.status[slot] = AgentStatus::recorded;
  agents.events[slot] = kEventNone;
  world.boxes[agent] = box_of(agents, slot);
  world.boxes_before[agent] = goes_on ? before : world.boxes[agent];
}

/// Returns the state of replayed track i `step` steps after the episode's start; is_present is 0 without such a track.
PICTURA_HD inline RecordedState replayed_state(const MapView& map, int i, int step) {
  const int agent = map.first_replayed + i;
  return agent < static_cast<int>(map.recorded_agents.size()) ? recorded_state(map, agent, step) : RecordedState{};
}

/// Places or removes the box of replayed track i. Only the first thread of the group writes.
template <typename ThreadGroup = SingleThread>
PICTURA_HD void replay_track(const WorldView& world, int i, int step, const ThreadGroup& group = {}) {
  const RecordedState at = replayed_state(world.map, i, step);
  AgentBox box;
  box.drawn = 0;
  if (at.is_present) {
    const RecordedAgent& recorded = world.map.recorded_agents[world.map.first_replayed + i];
    const auto agent_class = static_cast<AgentClass>(recorded.agent_class);
    const Vec3 p = at.position_m;
    const LaneFit fit = fit_class(world.map, agent_class, p.xy(), p.z, at.heading_rad, /*current_lane=*/-1, group);
    box = box_at(agent_class, {recorded.length_m, recorded.width_m, recorded.height_m}, {p.x, p.y, fit.z_m},
                 sincos_of(at.heading_rad));
  }
  if (group.rank() > 0) return;
  AgentBox& own = world.boxes[world.num_agents + i];
  const bool goes_on = step > 0 && own.drawn && box.drawn;
  world.boxes_before[world.num_agents + i] = goes_on ? own : box;
  own = box;
}

/// Starts the episode of a recorded agent, whose waypoints are all at the end of its record.
template <typename ThreadGroup>
PICTURA_HD void begin_record(const WorldView& world, int agent, const ThreadGroup& group) {
  const AgentStateView& agents = world.agents;
  const int slot = world.first_slot + agent;
  if (group.rank() == 0) {
    const Vec3 goal = world.map.recorded_agents[agent].goal_m;
    for (int i = 0; i < kNumWaypoints; ++i) {
      agents.waypoint_x_m[slot * kNumWaypoints + i] = goal.x;
      agents.waypoint_y_m[slot * kNumWaypoints + i] = goal.y;
      agents.waypoint_z_m[slot * kNumWaypoints + i] = goal.z;
    }
    agents.next_waypoint[slot] = kNumWaypoints - 1;
    agents.goal_chains[slot] = kRecordedGoal;
    agents.goal_x_m[slot] = goal.x;
    agents.goal_y_m[slot] = goal.y;
    agents.goal_z_m[slot] = goal.z;
    agents.goal_open[slot] = 1;
  }
  group.sync();
  follow_record(world, agent, 0, group);
}

}  // namespace pictura
