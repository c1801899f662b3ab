// Bitwise comparison of results, and actions for driving.
#pragma once

#include <cstring>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "pictura/common/rng.h"
#include "pictura/simulator/simulator.h"

namespace pictura::testing {

template <typename T>
bool same_bits(Span<T> a, Span<T> b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

/// Returns the first difference; empty if all bits are equal.
inline std::string first_difference(const ObservationView& a, const ObservationView& b) {
#define X(name, type, rows, features, part, comment)                                                             \
  if (!same_bits(a.name, b.name)) {                                                                              \
    for (size_t i = 0; i < a.name.size(); ++i) {                                                                 \
      if (!same_bits(a.name.subspan(i, 1), b.name.subspan(i, 1)))                                                \
        return fmt::format("{}[{}], {}: {} and {}", #name, i / ((rows) * (features)), i % ((rows) * (features)), \
                           a.name[i], b.name[i]);                                                                \
    }                                                                                                            \
  }
  PICTURA_OBSERVATION_ARRAYS(X)
#undef X
  return "";
}

/// Returns actions that keep most agents driving: usually no jerk, sometimes random.
inline std::vector<int32_t> mixed_actions(int num_slots, uint32_t step) {
  constexpr int32_t kCoasting = 2 * kNumLatActions + 1;
  std::vector<int32_t> actions;
  for (int slot = 0; slot < num_slots; ++slot) {
    RandomStream random({.seed = 9,
                         .world = static_cast<uint32_t>(slot / kMaxAgentsPerWorld),
                         .agent = static_cast<uint32_t>(slot % kMaxAgentsPerWorld),
                         .step = step,
                         .purpose = Purpose::action});
    actions.push_back(random.uniform() < 0.3f ? random.below(kNumActions) : kCoasting);
  }
  return actions;
}

/// Returns actions that drive at 3 to 8 m/s without steering. The state must be on the host.
inline std::vector<int32_t> straight_actions(const AgentStateView& state, int num_slots) {
  constexpr int32_t kStraight = 1, kBrake = kNumLatActions, kHold = 2 * kNumLatActions, kFaster = 3 * kNumLatActions;
  std::vector<int32_t> actions;
  for (int slot = 0; slot < num_slots; ++slot) {
    const float wanted_mps2 =
        (3.0f + static_cast<float>(slot % 6) - state.speed_mps[slot]) - state.accel_long_mps2[slot];
    actions.push_back(kStraight + (wanted_mps2 > 0.5f ? kFaster : wanted_mps2 < -0.5f ? kBrake : kHold));
  }
  return actions;
}

/// Returns mixed_actions() as commands, some of which instead move an agent a little or onto another agent, or remove
/// it. The state must be on the host.
inline std::vector<Command> mixed_commands(const AgentStateView& state, int num_slots, uint32_t step) {
  const std::vector<int32_t> actions = mixed_actions(num_slots, step);
  std::vector<Command> commands(actions.size());
  for (int slot = 0; slot < num_slots; ++slot) {
    Command& command = commands[slot];
    command.action = actions[slot];
    RandomStream random({.seed = 8,
                         .world = static_cast<uint32_t>(slot / kMaxAgentsPerWorld),
                         .agent = static_cast<uint32_t>(slot % kMaxAgentsPerWorld),
                         .step = step,
                         .purpose = Purpose::action});
    const float kind = random.uniform();
    if (kind >= 0.1f) continue;
    const int of = kind < 0.005f ? random.below(num_slots) : slot;
    command.kind = kind < 0.003f ? CommandKind::absent : CommandKind::kinematic_state;
    const float ahead_m = random.uniform(0, 3), left_m = random.uniform(-0.2f, 0.2f);
    command.x_m = state.x_m[of] + ahead_m * state.cos_heading[of] - left_m * state.sin_heading[of];
    command.y_m = state.y_m[of] + ahead_m * state.sin_heading[of] + left_m * state.cos_heading[of];
    command.z_m = state.z_m[of];
    command.heading_rad = state.heading_rad[of] + random.uniform(-0.1f, 0.1f);
    command.speed_mps = random.uniform(-1, 15);
  }
  return commands;
}

}  // namespace pictura::testing
