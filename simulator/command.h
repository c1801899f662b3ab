// Command of an agent for one step: an action, a state, leaving the episode, or following a record. A plain struct for
// host and device code.
#pragma once

#include "pictura/simulator/actions.h"

namespace pictura {

enum class CommandKind : int32_t {
  action,           // drives by its dynamics
  kinematic_state,  // is placed at a given pose with a given speed
  absent,           // leaves its world's episode
  recorded,         // follows its record in the recorded scene; absent at steps without a recorded state
};

/// Command of one slot for one step. A halted agent obeys no command. Other agents that are neither active nor recorded
/// obey only the command `recorded`.
/// - action: the agent takes this action, in [0, kNumActions).
/// - kinematic_state: sets the agent's reference point (see fields.h), heading and speed after the step. The agent's
///   acceleration, jerk and steering angle become 0. z_m selects the level on which to search for the road under the
///   agent. The agent gets the height of that road. Events are detected as for actions: leaving the road, red lights,
///   waypoints, and collisions along the straight line to the pose. Numbers must be finite. Coordinates must be at most
///   kMaxCommanded_m, headings at most kMaxCommanded_rad, and speeds at most kMaxCommanded_mps, all in absolute value.
/// - absent: the agent is AgentStatus::absent from this step until the end of the episode, or until a command
///   `recorded`. It is not drawn, does not collide, and its steps are not valid for learning. When the world tests
///   whether the episode ends, the agent counts as inactive. But on a map with a record and no replayed tracks, it
///   counts as active.
/// - recorded: the agent is AgentStatus::recorded. After step n of the episode, it has the state that was recorded n
///   steps after the record's start step. At steps of the record without a state it is absent. After the record's end
///   it keeps the state of the record's last step, with speed 0. It has no infractions and passes no waypoint, and its
///   steps are not valid for learning; other agents can collide with it. The command brings absent agents back; halted
///   agents remain halted. It is allowed only in worlds on a map with a record (compile_scenario()).
struct Command {
  CommandKind kind = CommandKind::action;
  int32_t action = kIdleAction;
  float x_m = 0, y_m = 0, z_m = 0;
  float heading_rad = 0;
  float speed_mps = 0;  // signed, along the heading
};

constexpr float kMaxCommanded_m = 1e6f, kMaxCommanded_rad = 100.0f, kMaxCommanded_mps = 100.0f;

}  // namespace pictura
