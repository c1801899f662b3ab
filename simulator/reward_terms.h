// Terms of the reward.
#pragma once

#include "pictura/common/portable/hd.h"

namespace pictura {

// X(name), in the order of summation.
#define PICTURA_REWARD_TERMS(X) \
  X(goal)                       \
  X(collision)                  \
  X(off_road)                   \
  X(stop_line)                  \
  X(comfort)                    \
  X(lane_align)                 \
  X(lane_center)                \
  X(velocity)                   \
  X(overspeed)                  \
  X(reverse)                    \
  X(timestep)

template <typename T>
struct RewardTermsOf {
#define X(name) T name = 0;
  PICTURA_REWARD_TERMS(X)
#undef X

  PICTURA_HD T total() const {
    T sum = 0;
#define X(name) sum += name;
    PICTURA_REWARD_TERMS(X)
#undef X
    return sum;
  }
};

using RewardTerms = RewardTermsOf<float>;

/// Sums for SimulatorTotals. Aligned, because a GPU copies 16 bytes with one instruction.
struct alignas(16) StepSums {
  float distance_m = 0;
  RewardTerms reward_terms;
};

}  // namespace pictura
