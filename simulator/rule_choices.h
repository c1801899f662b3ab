// Rules of the world with several sensible variants, of which a configuration chooses one. Both devices read them.
#pragma once

#include "pictura/common/portable/hd.h"

namespace pictura {

/// Coordination of a junction's traffic lights: the phases of the junction take turns, or each light cycles
/// independently.
enum class LightCycles : uint8_t { phases, independent };

/// Rules for an agent's motion at rest, in addition to its dynamics (rules/dynamics.h).
struct DynamicsRules {
  /// Whether the longitudinal acceleration ends in the step in which the speed would change its sign; both then become
  /// 0. Otherwise the acceleration persists and drives the agent on in the next step.
  bool reset_at_standstill = false;
  bool operator==(const DynamicsRules&) const = default;
};

constexpr int kMaxOtherPolicies = 8;

/// Shares of the agents that are impaired, or driven by other policies, drawn per episode. An agent is of at most one
/// kind; all remaining agents learn.
struct OtherShares {
  float blind = 0;                         // at times it sees no other road user
  float phantom_braking = 0;               // at times it brakes hard
  float inattentive = 0;                   // it sees no traffic lights
  float policies[kMaxOtherPolicies] = {};  // shares driven by each policy
  PICTURA_HD constexpr float sum() const {
    float all = blind + phantom_braking + inattentive;
    for (const float share : policies) all += share;
    return all;
  }
  bool operator==(const OtherShares&) const = default;
};

/// Impairments in the order of the members of OtherShares.
enum class Impairment : uint8_t { none, blind, phantom_braking, inattentive };
constexpr int kNumImpairments = 3;

}  // namespace pictura
