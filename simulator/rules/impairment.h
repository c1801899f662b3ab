// Agents that are impaired or driven by other policies. Counter-based random numbers determine these agents, so the
// state does not store them.
#pragma once

#include "pictura/common/rng.h"
#include "pictura/common/scene_types.h"
#include "pictura/simulator/rule_choices.h"
#include "pictura/simulator/rules/dynamics.h"

namespace pictura {

/// Draws an agent's driver kind for an episode: 0 for a learning agent, else 1 + the index of a share in OtherShares.
PICTURA_HD inline int draw_driver_kind(const OtherShares& shares, uint64_t seed, uint32_t world, uint32_t agent,
                                       uint32_t episode) {
  RandomStream random(
      {.seed = seed, .world = world, .agent = agent, .episode = episode, .purpose = Purpose::impairment});
  const float drawn = random.uniform();
  float bound = shares.blind;
  if (drawn < bound) return static_cast<int>(Impairment::blind);
  bound += shares.phantom_braking;
  if (drawn < bound) return static_cast<int>(Impairment::phantom_braking);
  bound += shares.inattentive;
  if (drawn < bound) return static_cast<int>(Impairment::inattentive);
  for (int i = 0; i < kMaxOtherPolicies; ++i) {
    bound += shares.policies[i];
    if (drawn < bound) return 1 + kNumImpairments + i;
  }
  return 0;
}

/// Return the impairment or the driver of a driver kind. driver_of() is 0 for the learning policy, and 1 + i for policy
/// i of OtherShares::policies.
PICTURA_HD constexpr Impairment impairment_of(int other) {
  return other > kNumImpairments ? Impairment::none : static_cast<Impairment>(other);
}
PICTURA_HD constexpr int driver_of(int other) { return max_of(other - kNumImpairments, 0); }

PICTURA_HD inline Impairment draw_impairment(const OtherShares& shares, uint64_t seed, uint32_t world, uint32_t agent,
                                             uint32_t episode) {
  return impairment_of(draw_driver_kind(shares, seed, world, agent, episode));
}

/// Whether an impairment is active after `step` steps of the episode. `inattentive` is always active. The others are
/// active once in every 10 s, for U(1, 5) s.
PICTURA_HD inline bool is_active_at(Impairment impairment, int step, float dt_s, uint64_t seed, uint32_t world,
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

/// Objects that an active impairment hides from images and observations.
PICTURA_HD constexpr Hides hidden_by(Impairment shown) {
  if (shown == Impairment::blind) return kHidesAgents;
  return shown == Impairment::inattentive ? kHidesLights : kHidesNothing;
}

/// Jerk of braking for no reason, opposite to the motion. An agent at rest stays at rest.
PICTURA_HD inline float braking_jerk_mps3(const Motion& motion) {
  const float hardest_mps3 = controls_of_action(0).jerk_long_mps3;
  const float forwards = motion.speed_mps != 0.0f ? motion.speed_mps : motion.accel_long_mps2;
  return forwards == 0.0f ? 0.0f : forwards > 0.0f ? hardest_mps3 : -hardest_mps3;
}

}  // namespace pictura
