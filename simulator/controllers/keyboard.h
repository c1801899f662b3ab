// Driving by hand: which action of the policy's space a person's keys ask for.
#pragma once

#include <cstdint>

#include "pictura/simulator/fields.h"

namespace pictura {

/// What is held down. Without a key the agent keeps its speed and straightens.
struct DrivingKeys {
  bool forward = false;   // speeds up
  bool backward = false;  // brakes, and at rest begins to reverse
  bool stop = false;      // brakes as hard as it may, and stays at rest
  bool left = false, right = false;
  bool operator==(const DrivingKeys&) const = default;
};

/// The action that brings the acceleration of a slot nearest to what the keys ask for, after a step of dt_s.
int32_t action_of_keys(const DrivingKeys& keys, const AgentStateView& state, int slot, float dt_s);

}  // namespace pictura
