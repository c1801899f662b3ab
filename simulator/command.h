// Command of an agent for one step: an action of the policy's space, a state, or leaving the episode. A plain struct
// that both devices read.
#pragma once

#include "pictura/simulator/actions.h"

namespace pictura {

enum class CommandKind : int32_t {
  action,           // drives by its dynamics
  kinematic_state,  // is placed at a pose and speed, such as those of a recorded trajectory
  absent,           // leaves its world's episode
  recorded,         // follows the record of its world's scene; absent at steps without a recorded state
};

/// Command of one slot for one step. Except for `recorded`, commands to agents that are neither active nor recorded are
/// ignored.
/// - action: in [0, kNumActions).
/// - kinematic_state: the agent's reference point (see fields.h), heading and speed after the step. Its acceleration,
///   jerk and steering angle become 0. z_m selects the level on which roads are searched; the agent's height is then
///   that of the road. Events are detected as for actions: collisions on the straight way to the pose and at the pose,
///   the road, lights and waypoints. Numbers must be finite, with |x_m|, |y_m| and |z_m| at most kMaxCommanded_m,
///   |heading_rad| at most kMaxCommanded_rad, and |speed_mps| at most kMaxCommanded_mps.
/// - absent: from this step until the end of the episode the agent is AgentStatus::absent: it is not drawn, does not
///   collide, and is not valid. It counts among the inactive agents that end an episode.
/// - recorded: the agent is AgentStatus::recorded. After step n of the episode it has the state of its record n steps
///   after the start. At steps without a recorded state it is absent. After the record's end it keeps its last pose. It
///   has no infractions, passes no waypoint and is not valid; other agents can collide with it. Absent agents return;
///   halted agents remain halted. Only in worlds on a map with a record (compile_scenario()).
struct Command {
  CommandKind kind = CommandKind::action;
  int32_t action = kIdleAction;
  float x_m = 0, y_m = 0, z_m = 0;
  float heading_rad = 0;
  float speed_mps = 0;  // signed, along the heading
};

constexpr float kMaxCommanded_m = 1e6f, kMaxCommanded_rad = 100.0f, kMaxCommanded_mps = 100.0f;

}  // namespace pictura
