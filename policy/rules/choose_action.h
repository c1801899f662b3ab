// Choice of an agent's action. Draws depend only on (seed, global world, agent, episode, step), and are equal on all
// devices.
#pragma once

#include "pictura/common/math.h"
#include "pictura/common/rng.h"
#include "pictura/simulator/controllers/controller.h"

namespace pictura {

/// Returns the first of the most likely actions. log_probs: [num_actions].
PICTURA_HD inline int32_t most_likely_action(const float* log_probs, int num_actions) {
  int32_t best = 0;
  for (int i = 1; i < num_actions; ++i) {
    if (log_probs[i] > log_probs[best]) best = i;
  }
  return best;
}

/// Returns the first action at which the cumulative probability exceeds `uniform` in [0, 1).
PICTURA_HD inline int32_t draw_action(const float* log_probs, int num_actions, float uniform) {
  double cumulative = 0;
  for (int i = 0; i + 1 < num_actions; ++i) {
    cumulative += static_cast<double>(exp_of(log_probs[i]));
    if (static_cast<double>(uniform) < cumulative) return i;
  }
  return num_actions - 1;
}

/// Key of an action's random draw.
struct ActionKey {
  uint64_t seed;
  uint32_t global_world, agent, episode, step;  // agent: index in its world
};

PICTURA_HD inline int32_t draw_action(const float* log_probs, int num_actions, const ActionKey& key) {
  RandomStream stream({.seed = key.seed,
                       .world = key.global_world,
                       .agent = key.agent,
                       .episode = key.episode,
                       .step = key.step,
                       .purpose = Purpose::action});
  return draw_action(log_probs, num_actions, stream.uniform());
}

/// Rule of choice.
struct ActionChoice {
  bool argmax = false;  // true: the most likely action; false: a random draw
  uint64_t seed = 0;
};

/// Chooses the action of the agent in a slot.
struct ActionRule {
  SlotTable slots;
  Span<const int32_t> episode_index, episode_step;  // [worlds]
  ActionChoice choice;

  ActionRule(const SimulatorArrays& input, const ActionChoice& its_choice)
      : slots(input.slots), episode_index(input.episode_index), episode_step(input.episode_step), choice(its_choice) {}

  /// log_probs: [kNumActions].
  PICTURA_HD int32_t operator()(int64_t slot, const float* log_probs) const {
    if (choice.argmax) return most_likely_action(log_probs, kNumActions);
    const auto world = static_cast<size_t>(slots.world_of_slot[slot]);
    const ActionKey key{choice.seed, slots.global_world[world], static_cast<uint32_t>(slots.agent_of_slot[slot]),
                        static_cast<uint32_t>(episode_index[world]), static_cast<uint32_t>(episode_step[world])};
    return draw_action(log_probs, kNumActions, key);
  }
};

/// Writes an action's command if the mask selects the slot.
PICTURA_HD inline void write_command(const int32_t* actions, Span<const uint8_t> mask, int64_t slot,
                                     Command* commands_out) {
  if (!mask.empty() && !mask[slot]) return;
  commands_out[slot] = {};
  commands_out[slot].action = actions[slot];
}

/// Test whether an agent holds its action between the policy's decisions. It does not in its first step after a reset,
/// the start of a life, or inactivity, nor after it left the map.
struct HeldActions {
  const uint8_t* acted_before = nullptr;  // [slots] whether active at the previous step; null: no agent holds
  const int32_t *world_of_slot = nullptr, *life_step = nullptr;  // [slots]
  const uint8_t* left = nullptr;                                 // [slots]
  const int32_t* episode_step = nullptr;                         // [worlds]
  const uint8_t* episode_over = nullptr;                         // [worlds] 1: no agent holds; or null

  HeldActions() = default;
  /// decides_at_end: whether no agent holds its action at the end of an episode.
  HeldActions(const SimulatorArrays& input, const uint8_t* its_acted_before, bool decides_at_end)
      : acted_before(its_acted_before),
        world_of_slot(input.slots.world_of_slot.data()),
        life_step(input.state.life_step),
        left(input.state.left),
        episode_step(input.episode_step.data()),
        episode_over(decides_at_end ? input.episode_over.data() : nullptr) {}

  PICTURA_HD bool holds(int64_t slot) const {
    if (acted_before == nullptr || !acted_before[slot] || left[slot]) return false;
    const int32_t world = world_of_slot[slot];
    return episode_step[world] != life_step[slot] && (episode_over == nullptr || !episode_over[world]);
  }
};

/// Whether all active agents decide at a step, and none holds its action. num_acted: number of slots at the previous
/// step, 0 at the first.
constexpr bool all_decide(int64_t step, int64_t decision_steps, size_t num_acted, size_t num_slots) {
  return step % decision_steps == 0 || num_acted != num_slots;
}

/// Test whether the policy is evaluated for a slot.
struct DecidingSlots {
  const AgentStatus* status;
  Span<const uint8_t> mask;  // [slots] 0: excluded; empty: no slot is excluded
  const uint8_t* left;       // [slots] 1: just left the map, and is included; or null
  HeldActions held{};

  PICTURA_HD bool operator()(int64_t slot) const {
    const bool is_asked = takes_actions(status[slot]) || (left != nullptr && left[slot] != 0);
    return is_asked && (mask.empty() || mask[slot]) && !held.holds(slot);
  }
};

}  // namespace pictura
