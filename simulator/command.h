// What an agent is told to do in one step: an action of the policy's space, a state to be in, or to leave. A plain
// struct that both devices read.
#pragma once

#include "pictura/simulator/actions.h"

namespace pictura {

enum class CommandKind : int32_t {
  action,           // drives by its dynamics
  kinematic_state,  // is put at a pose and speed, as a recorded trajectory has them
  absent,           // leaves its world's episode
  recorded,         // is where the record of its world's scene has it, or nowhere
};

/// Of one slot for one step. Commands to agents that are neither active nor recorded are ignored, but for `recorded`.
/// - action: in [0, kNumActions).
/// - kinematic_state: the agent's reference point (see fields.h), heading and speed after the step. Its acceleration,
///   jerk and steering angle become 0. z_m says on which level roads are looked for; the agent's own height is then
///   that of the road. Events are found as for actions: collisions on the straight way to the pose and there, the
///   road, lights and waypoints. Numbers must be finite, |x_m|, |y_m| and |z_m| at most kMaxCommanded_m, |heading_rad|
///   at most kMaxCommanded_rad, |speed_mps| at most kMaxCommanded_mps.
/// - absent: from this step until the end of the episode the agent is AgentStatus::absent: it is not drawn, nobody
///   meets it, and it is not valid. It counts among the inactive agents that end an episode.
/// - recorded: the agent is AgentStatus::recorded and stands, after step n of the episode, where its record has it n
///   steps after its start; where the record has nothing it is absent until a step that has it again. After the
///   record's end it stays where it was. It meets no infraction, passes no waypoint and is not valid; others meet it.
///   Who was absent comes back, who has halted stays. Only in worlds on a map with a record (compile_scenario()).
struct Command {
  CommandKind kind = CommandKind::action;
  int32_t action = kIdleAction;
  float x_m = 0, y_m = 0, z_m = 0;
  float heading_rad = 0;
  float speed_mps = 0;  // signed, along the heading
};

constexpr float kMaxCommanded_m = 1e6f, kMaxCommanded_rad = 100.0f, kMaxCommanded_mps = 100.0f;

}  // namespace pictura
