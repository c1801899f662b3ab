// Impaired agents: which agents of an episode are impaired, when it shows, and what they then miss or do. All of it
// follows from counter-based numbers, so that no state holds it and no observation tells it.
#pragma once

#include "pictura/common/rng.h"
#include "pictura/common/scene_types.h"
#include "pictura/simulator/rule_choices.h"
#include "pictura/simulator/rules/dynamics.h"

namespace pictura {

/// Draws an agent's impairment in an episode.
PICTURA_HD inline Impairment draw_impairment(const ImpairedShares& shares, uint64_t seed, uint32_t world,
                                             uint32_t agent, uint32_t episode) {
  if (shares.sum() <= 0.0f) return Impairment::none;
  RandomStream random(
      {.seed = seed, .world = world, .agent = agent, .episode = episode, .purpose = Purpose::impairment});
  const float drawn = random.uniform();
  if (drawn < shares.blind) return Impairment::blind;
  if (drawn < shares.blind + shares.phantom_braking) return Impairment::phantom_braking;
  return drawn < shares.sum() ? Impairment::inattentive : Impairment::none;
}

/// Whether an agent's impairment shows in what it sees after `step` steps of the episode, and in what it does next.
/// Inattention lasts; the others show in one spell of U(1, 5) s in every 10 s, which begins anywhere in them.
PICTURA_HD inline bool shows_at(Impairment impairment, int step, float dt_s, uint64_t seed, uint32_t world,
                                uint32_t agent, uint32_t episode) {
  constexpr float kPeriod_s = 10.0f, kMinSpell_s = 1.0f, kMaxSpell_s = 5.0f;
  if (impairment == Impairment::none || impairment == Impairment::inattentive) return impairment != Impairment::none;
  const int period_steps = static_cast<int>(kPeriod_s / dt_s + 0.5f);
  RandomStream random({.seed = seed,
                       .world = world,
                       .agent = agent,
                       .episode = episode,
                       .step = static_cast<uint32_t>(step / period_steps),
                       .purpose = Purpose::impaired_spell});
  const int spell_steps = static_cast<int>(random.uniform(kMinSpell_s, kMaxSpell_s) / dt_s + 0.5f);
  const int since_begin = step % period_steps - random.below(period_steps - spell_steps + 1);
  return since_begin >= 0 && since_begin < spell_steps;
}

/// What the views of an agent leave out while this impairment shows.
PICTURA_HD constexpr Hides hidden_by(Impairment shown) {
  if (shown == Impairment::blind) return kHidesAgents;
  return shown == Impairment::inattentive ? kHidesLights : kHidesNothing;
}

/// The longitudinal jerk of a phantom braking, against the motion. An agent at rest is held there.
PICTURA_HD inline float braking_jerk_mps3(const Motion& motion) {
  const float hardest_mps3 = controls_of_action(0).jerk_long_mps3;
  const float forwards = motion.speed_mps != 0.0f ? motion.speed_mps : motion.accel_long_mps2;
  return forwards == 0.0f ? 0.0f : forwards > 0.0f ? hardest_mps3 : -hardest_mps3;
}

}  // namespace pictura
