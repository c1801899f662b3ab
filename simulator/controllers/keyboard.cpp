#include "pictura/simulator/controllers/keyboard.h"

#include <algorithm>
#include <cmath>

#include "pictura/simulator/rules/dynamics.h"

namespace pictura {

namespace {

// Values that are comfortable for a person who views the scene from above with a delay of 0.1 s.
constexpr float kForward_mps2 = 2.5f, kBackward_mps2 = -4.0f, kReverse_mps2 = -1.5f, kStop_mps2 = 8.0f;
constexpr float kMaxTurn_mps2 = 3.0f, kTurnAtRest_mps2 = 0.3f, kTurnPerSpeed_per_s = 0.35f;
constexpr float kRestSpeed_mps = 0.3f;

float wanted_long(const DrivingKeys& keys, float speed_mps) {
  if (keys.stop) {
    // The maximum braking that the highest jerk can reduce to 0 before the agent comes to rest.
    const float release_mps3 = controls_of_action(kNumActions - 1).jerk_long_mps3;
    const float braking = std::min(kStop_mps2, std::sqrt(2 * release_mps3 * std::fabs(speed_mps)));
    return speed_mps > 0 ? -braking : braking;
  }
  if (keys.forward == keys.backward) return 0;
  if (keys.forward) return kForward_mps2;
  return speed_mps > kRestSpeed_mps ? kBackward_mps2 : kReverse_mps2;
}

float wanted_lat(const DrivingKeys& keys, float speed_mps) {
  if (keys.left == keys.right) return 0;
  const float turn = std::min(kMaxTurn_mps2, kTurnAtRest_mps2 + kTurnPerSpeed_per_s * std::fabs(speed_mps));
  return keys.left ? turn : -turn;
}

// Returns the difference between `wanted` and the acceleration after a step with this jerk. An acceleration whose sign
// would change becomes 0 (rules/dynamics.h).
float miss(float from, float jerk_mps3, float dt_s, float wanted) {
  return std::fabs(stop_at_zero(from, from + jerk_mps3 * dt_s, -1e6f, 1e6f) - wanted);
}

}  // namespace

int32_t action_of_keys(const DrivingKeys& keys, const AgentStateView& state, int slot, float dt_s) {
  const float speed_mps = state.speed_mps[slot];
  const float along = wanted_long(keys, speed_mps), across = wanted_lat(keys, speed_mps);
  int32_t best = kIdleAction;
  float minimum = INFINITY;
  for (int32_t action = 0; action < kNumActions; ++action) {
    const Controls controls = controls_of_action(action);
    const float missed = miss(state.accel_long_mps2[slot], controls.jerk_long_mps3, dt_s, along) +
                         miss(state.accel_lat_mps2[slot], controls.jerk_lat_mps3, dt_s, across);
    if (missed < minimum) {
      minimum = missed;
      best = action;
    }
  }
  return best;
}

}  // namespace pictura
