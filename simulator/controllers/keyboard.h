// Manual driving with a keyboard.
#pragma once

#include <cstdint>

#include "pictura/simulator/fields.h"

namespace pictura {

/// Pressed keys. Without a pressed key, the agent keeps its speed and straightens its steering.
struct DrivingKeys {
  bool forward = false;   // accelerates
  bool backward = false;  // brakes; at rest, starts to reverse
  bool stop = false;      // brakes as hard as possible; stays at rest
  bool left = false, right = false;
  bool operator==(const DrivingKeys&) const = default;
};

/// Returns the action that brings the agent's accelerations, after a step of dt_s, nearest to those that the keys
/// request.
int32_t action_of_keys(const DrivingKeys& keys, const AgentStateView& state, int slot, float dt_s);

}  // namespace pictura
