// Generalized advantage estimation (Schulman et al., 2016) over time-first rollouts with next-step autoreset.
#pragma once

#include <vector>

#include "pictura/common/portable/hd.h"

namespace pictura {

/// Advantages of a rollout. All arrays are [num_steps, num_slots], time first; `values` has one row more, for the
/// observation after the last step. A transition that is
///   terminated  does not bootstrap;
///   truncated   bootstraps from the value of the next row, which is the final observation's: the world is reset by the
///               call after, whose transition is not valid; nothing flows back over the end of an episode;
///   not valid   (its agent had halted, or its world was being reset) gets 0 and ends what comes before it.
inline void gae(int64_t num_steps, int64_t num_slots, const float* rewards, const float* values,
                const uint8_t* terminated, const uint8_t* truncated, const uint8_t* valid, float gamma,
                float gae_lambda, float* advantages_out) {
  // Rows are walked backwards and slots forwards: every inner loop runs over consecutive memory.
  std::vector<float> later(static_cast<size_t>(num_slots), 0.0f);  // advantage of the next step, where it counts
  for (int64_t t = num_steps - 1; t >= 0; --t) {
    for (int64_t slot = 0; slot < num_slots; ++slot) {
      const int64_t i = t * num_slots + slot;
      const float bootstrap = terminated[i] ? 0.0f : values[i + num_slots];
      const float delta = rewards[i] + gamma * bootstrap - values[i];
      const bool goes_on = !terminated[i] && !truncated[i];
      const float advantage = delta + gamma * gae_lambda * (goes_on ? later[static_cast<size_t>(slot)] : 0.0f);
      later[static_cast<size_t>(slot)] = advantages_out[i] = valid[i] ? advantage : 0.0f;
    }
  }
}

}  // namespace pictura
