// Rules of the simulation with several variants, of which a configuration chooses one. Code on the host and on GPUs
// reads them.
#pragma once

#include "pictura/common/portable/hd.h"

namespace pictura {

/// Coordination of a junction's traffic lights. `phases`: groups of its lights are green in turn. `independent`: each
/// light cycles on its own.
enum class LightCycles : uint8_t { phases, independent };

/// Options of an agent's dynamics (rules/dynamics.h).
struct DynamicsRules {
  /// If true, speed and longitudinal acceleration become 0 in the step in which the speed would change its sign. If
  /// false, the acceleration persists, so that the agent moves on in the next step.
  bool reset_at_standstill = false;
  bool operator==(const DynamicsRules&) const = default;
};

constexpr int kMaxOtherPolicies = 8;

/// Shares of the agents that are impaired, or that other policies drive. Each episode draws these agents again. An
/// agent belongs to at most one share; all remaining agents learn.
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
