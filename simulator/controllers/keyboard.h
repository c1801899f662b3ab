// Manual driving: the mapping from keys to actions of the policy's space.
#pragma once

#include <cstdint>

#include "pictura/simulator/fields.h"

namespace pictura {

/// State of the keys. Without a key, the agent keeps its speed and straightens.
struct DrivingKeys {
  bool forward = false;   // accelerates
  bool backward = false;  // brakes, and at rest starts to reverse
  bool stop = false;      // brakes at the maximum, and stays at rest
  bool left = false, right = false;
  bool operator==(const DrivingKeys&) const = default;
};

/// Returns the action after which, at the end of a step of dt_s, the slot's acceleration is nearest to the keys'
/// request.
int32_t action_of_keys(const DrivingKeys& keys, const AgentStateView& state, int slot, float dt_s);

}  // namespace pictura
