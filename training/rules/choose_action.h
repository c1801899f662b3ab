// How an action is chosen from the log-probabilities of one agent: the most likely one, or a draw. Draws are keyed by
// (seed, global world, agent, episode, step), so they depend on no order and no device.
#pragma once

#include "pictura/common/math.h"
#include "pictura/common/rng.h"

namespace pictura {

/// The first of the most likely actions. log_probs: [num_actions].
PICTURA_HD inline int32_t most_likely_action(const float* log_probs, int num_actions) {
  int32_t best = 0;
  for (int i = 1; i < num_actions; ++i) {
    if (log_probs[i] > log_probs[best]) best = i;
  }
  return best;
}

/// The first action at which the cumulative probability exceeds `uniform` in [0, 1).
PICTURA_HD inline int32_t draw_action(const float* log_probs, int num_actions, float uniform) {
  double cumulative = 0;
  for (int i = 0; i + 1 < num_actions; ++i) {
    cumulative += static_cast<double>(exp_of(log_probs[i]));
    if (static_cast<double>(uniform) < cumulative) return i;
  }
  return num_actions - 1;
}

/// Whose action is drawn, and when.
struct ActionKey {
  uint64_t seed;
  uint32_t global_world, agent, episode, step;  // agent: its number in its world
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

}  // namespace pictura
