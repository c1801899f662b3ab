// Command of an agent for one step.
#pragma once

#include "pictura/simulator/actions.h"

namespace pictura {

enum class CommandKind : int32_t {
  action,           // drives by its dynamics
  kinematic_state,  // is placed at a pose
  absent,           // leaves its episode
  recorded,         // follows its record
};

/// Command of one slot for one step. A halted agent obeys no command. Other agents that are neither active nor recorded
/// obey only `recorded`.
/// - action: the agent takes this action, in [0, kNumActions).
/// - kinematic_state: sets reference point (fields.h), heading and speed after the step. Acceleration, jerk and
///   steering angle become 0. The agent gets the height of the road on the level of z_m. Red lights, waypoints and
///   collisions are detected along the straight line to the pose, collisions only as far as the map's fastest agent
///   drives in a step; walls and road edges are tested at the pose. Numbers must be finite and at most kMaxCommanded_m,
///   kMaxCommanded_rad and kMaxCommanded_mps in absolute value.
/// - absent: the agent is AgentStatus::absent until the end of the episode or a command `recorded`. Its steps are not
///   valid for learning. It counts as inactive in episode_ends(), except on a map with a record and no
///   replayed tracks.
/// - recorded: the agent is AgentStatus::recorded, which only maps with a record allow (compile_scenario()). After step
///   n of the episode, it has the state recorded n steps after the record's start step; without this state, it is
///   absent. After the record's end, it keeps the last state, with speed 0. It has no events, and its steps are not
///   valid for learning. The command brings absent agents back.
struct Command {
  CommandKind kind = CommandKind::action;
  int32_t action = kIdleAction;
  float x_m = 0, y_m = 0, z_m = 0;
  float heading_rad = 0;
  float speed_mps = 0;  // signed, along the heading
};

constexpr float kMaxCommanded_m = 1e6f, kMaxCommanded_rad = 100.0f, kMaxCommanded_mps = 100.0f;

}  // namespace pictura
