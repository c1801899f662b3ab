// Which transitions are learnt from (paper, appendix, optimization; after Gigaflow): those whose advantage is not small
// against an exponential average of the rollouts' largest ones.
#pragma once

#include "pictura/common/portable/hd.h"

namespace pictura {

/// The average after a rollout whose largest |advantage| is `max_advantage`; a negative average means: none before.
PICTURA_HD inline double filter_average(double average, float max_advantage, double ema) {
  return average < 0 ? static_cast<double>(max_advantage)
                     : ema * static_cast<double>(max_advantage) + (1 - ema) * average;
}

/// The least |advantage| that is kept.
PICTURA_HD inline float filter_threshold(double average, double fraction) {
  return static_cast<float>(fraction * average);
}

PICTURA_HD inline bool filter_keeps(float advantage, bool is_valid, float threshold) {
  return is_valid && (advantage < 0 ? -advantage : advantage) >= threshold;
}

}  // namespace pictura
