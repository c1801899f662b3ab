// List of all fields of an agent's state, each an array over all agents. Hashes, checkpoints and bindings use the order
// of this list.
#pragma once

#include "pictura/common/color.h"
#include "pictura/common/portable/hd.h"

namespace pictura {

/// Status of a controlled agent. Halted agents remain as obstacles. Recorded agents are obstacles too, but have no
/// events until an action makes them active. Waiting agents have left an open map and have no box until they enter
/// again.
enum class AgentStatus : uint8_t { active, halted, parked, absent, recorded, waiting };

PICTURA_HD constexpr bool has_body(AgentStatus status) {
  return status != AgentStatus::absent && status != AgentStatus::waiting;
}

/// Whether an action would move the agent.
PICTURA_HD constexpr bool takes_actions(AgentStatus status) {
  return status == AgentStatus::active || status == AgentStatus::recorded;
}

/// Consequence of an infraction: the agent halts, leaves the episode, or drives on.
enum class AfterInfraction : uint8_t { halt, leave, drive_on };

/// Reason why an agent got no place in its episode.
enum class SpawnFailure : uint8_t {
  none,
  no_place,  // none on the map for its class
  taken,     // no tried place was free
};

/// Event bits of an agent's step. halt_reason stores the events that halted it.
enum Event : uint8_t {
  kEventNone = 0,
  kEventCollision = 1,
  kEventAtFault = 2,  // always with kEventCollision
  kEventOffRoad = 4,
  kEventRedLight = 8,
  kEventWall = 16,
  kEventGoal = 32,         // passed a chain's last waypoint
  kEventWaypoint = 64,     // passed an intermediate waypoint
  kEventMetricGoal = 128,  // passed a chain's last waypoint within 2 m
};
constexpr int kInfractions = kEventCollision | kEventOffRoad | kEventRedLight | kEventWall;

constexpr int kNumWaypoints = 3;

// X(name, type, values per agent, initial value, comment).
#define PICTURA_EPISODE_FIELDS(X)                                                                                \
  X(x_m, float, 1, 0, "rear axle, or the centre of a pedestrian")                                                \
  X(y_m, float, 1, 0, "")                                                                                        \
  X(z_m, float, 1, 0, "height of the road under it")                                                             \
  X(heading_rad, float, 1, 0, "counter-clockwise from x, in [-pi, pi]")                                          \
  X(cos_heading, float, 1, 1, "")                                                                                \
  X(sin_heading, float, 1, 0, "")                                                                                \
  X(speed_mps, float, 1, 0, "signed, along the heading")                                                         \
  X(accel_long_mps2, float, 1, 0, "")                                                                            \
  X(accel_lat_mps2, float, 1, 0, "positive to the left")                                                         \
  X(steer_rad, float, 1, 0, "front wheel angle, positive to the left")                                           \
  X(jerk_long_mps3, float, 1, 0, "realised in the last step")                                                    \
  X(jerk_lat_mps3, float, 1, 0, "")                                                                              \
  X(length_m, float, 1, 0, "length of the box")                                                                  \
  X(width_m, float, 1, 0, "")                                                                                    \
  X(height_m, float, 1, 0, "")                                                                                   \
  X(lane, int32_t, 1, -1, "current lane, -1 none")                                                               \
  X(lane_offset_m, float, 1, 0, "signed, positive to the left of the centre line")                               \
  X(lane_angle_rad, float, 1, 0, "heading less the lane's direction, in [-pi, pi]")                              \
  X(speed_limit_mps, float, 1, 0, "limit of the current lane")                                                   \
  X(waypoint_x_m, float, 3, 0, "the goal chain; passed waypoints stay until it is renewed")                      \
  X(waypoint_y_m, float, 3, 0, "")                                                                               \
  X(waypoint_z_m, float, 3, 0, "")                                                                               \
  X(next_waypoint, int32_t, 1, 0, "index of the active one, in [0, 3)")                                          \
  X(goal_lane, int32_t, 1, -1, "lane (or piece of a walkway) of the last waypoint, where the next chain starts") \
  X(goal_lane_s_m, float, 1, 0, "arc length of the last waypoint on it")                                         \
  X(goal_chains, int32_t, 1, 0, "chains drawn in this episode")                                                  \
  X(goal_x_m, float, 1, 0, "last waypoint of a chain, for the metric Goals; see rules/step.h")                   \
  X(goal_y_m, float, 1, 0, "")                                                                                   \
  X(goal_z_m, float, 1, 0, "")                                                                                   \
  X(goal_open, uint8_t, 1, 0, "1: the goal is set and not yet passed")                                           \
  X(conditioning, float, 17, 0, "reward coefficients and dynamics multipliers; see simulator/conditioning.h")    \
  X(agent_class, AgentClass, 1, AgentClass::vehicle, "AgentClass")                                               \
  X(status, AgentStatus, 1, AgentStatus::absent, "AgentStatus")                                                  \
  X(refusal, SpawnFailure, 1, SpawnFailure::none, "SpawnFailure, of an absent agent")                            \
  X(halt_reason, uint8_t, 1, 0, "Event bits that halted it")                                                     \
  X(events, uint8_t, 1, 0, "Event bits of the last step")                                                        \
  X(goals_reached, int32_t, 1, 0, "last waypoints passed within 2 m in this episode")                            \
  X(waypoints_reached, int32_t, 1, 0, "waypoints (also goals) passed within the reward's radius")                \
  X(distance_m, float, 1, 0, "sum of |speed| dt in this episode")                                                \
  X(first_motion_step, int32_t, 1, 0, "first step (from 1) with a speed above kRest_mps; 0: none yet")           \
  X(episode_events, uint8_t, 1, 0, "union of the episode's event bits")                                          \
  X(episode_return, float, 1, 0, "sum of rewards in this episode")

// Fields of lives. A life lasts from an agent's start or entry until the agent leaves the map or halts, or the episode
// ends. A slot can have several lives only on open maps, whose roads end. On other maps these fields keep their initial
// values, and saved states and hashes omit them.
#define PICTURA_LIFE_FIELDS(X)                                                \
  X(life, int32_t, 1, 0, "number of earlier lives in this episode")           \
  X(life_step, int32_t, 1, 0, "step of this episode at which the life began") \
  X(left, uint8_t, 1, 0, "1: it left in the last step")

#define PICTURA_AGENT_FIELDS(X) PICTURA_EPISODE_FIELDS(X) PICTURA_LIFE_FIELDS(X)

/// Arrays of all fields, in host or device memory.
struct AgentStateView {
#define X(name, type, per_agent, first, comment) type* name;
  PICTURA_AGENT_FIELDS(X)
#undef X
};

/// Reads all fields before it writes the first, so that a GPU can overlap reads.
PICTURA_HD inline void copy_fields(const AgentStateView& from, int from_slot, const AgentStateView& to, int to_slot){
#define X(name, type, per_agent, first, comment) \
  type name[per_agent];                          \
  for (int i = 0; i < (per_agent); ++i) name[i] = from.name[from_slot * (per_agent) + i];
    PICTURA_AGENT_FIELDS(X)
#undef X
#define X(name, type, per_agent, first, comment) \
  for (int i = 0; i < (per_agent); ++i) to.name[to_slot * (per_agent) + i] = name[i];
        PICTURA_AGENT_FIELDS(X)
#undef X
}

/// Sets initial values.
PICTURA_HD inline void reset_fields(const AgentStateView& agents, int slot) {
#define X(name, type, per_agent, first, comment) \
  for (int i = 0; i < (per_agent); ++i) agents.name[slot * (per_agent) + i] = static_cast<type>(first);
  PICTURA_AGENT_FIELDS(X)
#undef X
}

}  // namespace pictura
