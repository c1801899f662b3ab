// Rules of the world of which a configuration chooses one, where several are sensible. Both devices read them.
#pragma once

#include "pictura/common/portable/hd.h"

namespace pictura {

/// How the traffic lights of a junction go together: the phases of the junction take turns, or each light cycles alone
/// and knows nothing of the others.
enum class LightCycles : uint8_t { phases, independent };

/// What happens to an agent's motion at rest, on top of its dynamics (rules/dynamics.h).
struct DynamicsRules {
  /// The longitudinal acceleration ends in the step in which the speed would change its sign, and becomes 0 as the
  /// speed does. Without it the acceleration lasts, and drives the agent on in the next step.
  bool reset_at_standstill = false;
  bool operator==(const DynamicsRules&) const = default;
};

constexpr int kMaxOtherPolicies = 8;

/// Shares of the agents that are impaired, or driven by other policies, drawn per episode: an agent is of one kind at
/// most, and the other agents learn.
struct OtherShares {
  float blind = 0;                         // now and then it sees no other road user
  float phantom_braking = 0;               // now and then it brakes hard
  float inattentive = 0;                   // it sees no traffic light
  float policies[kMaxOtherPolicies] = {};  // driven by each
  PICTURA_HD constexpr float sum() const {
    float all = blind + phantom_braking + inattentive;
    for (const float share : policies) all += share;
    return all;
  }
  bool operator==(const OtherShares&) const = default;
};

/// In the order of the members of OtherShares.
enum class Impairment : uint8_t { none, blind, phantom_braking, inattentive };
constexpr int kNumImpairments = 3;

}  // namespace pictura
