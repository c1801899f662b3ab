// Variants of the rules, of which a configuration chooses one.
#pragma once

#include "pictura/common/portable/hd.h"

namespace pictura {

/// `phases`: groups of a junction's lights are green in turn. `independent`: each light cycles on its own.
enum class LightCycles : uint8_t { phases, independent };

/// Options of rules/dynamics.h.
struct DynamicsRules {
  /// true: speed and longitudinal acceleration become 0 when the speed would change its sign. false: the acceleration
  /// persists, so that the agent moves in the next step.
  bool reset_at_standstill = false;
  bool operator==(const DynamicsRules&) const = default;
};

constexpr int kMaxOtherPolicies = 8;

/// Shares of agents that are impaired or driven by other policies; each episode draws these agents. All remaining
/// agents learn.
struct OtherShares {
  float blind = 0;            // at times sees no other road user
  float phantom_braking = 0;  // at times brakes hard
  float inattentive = 0;      // sees no traffic lights
  float policies[kMaxOtherPolicies] = {};
  PICTURA_HD constexpr float sum() const {
    float all = blind + phantom_braking + inattentive;
    for (const float share : policies) all += share;
    return all;
  }
  bool operator==(const OtherShares&) const = default;
};

enum class Impairment : uint8_t { none, blind, phantom_braking, inattentive };
constexpr int kNumImpairments = 3;

}  // namespace pictura
