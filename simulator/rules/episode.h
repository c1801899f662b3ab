// When a world's episode ends.
#pragma once

#include "pictura/simulator/rules/world_view.h"

namespace pictura {

/// After `steps` steps, with `spawned` agents of which `active` still drive: time is up, or too many are inactive.
PICTURA_HD inline bool episode_ends(const RuleOptions& options, int steps, int spawned, int active) {
  if (steps >= options.episode_steps) return true;
  const float inactive = static_cast<float>(spawned - active);
  return spawned > 0 && inactive >= options.reset_inactive_fraction * static_cast<float>(spawned);
}

}  // namespace pictura
