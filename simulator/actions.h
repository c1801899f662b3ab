// Discrete action space (paper, policy architecture): 4 longitudinal times 3 lateral jerks.
#pragma once

#include "pictura/common/portable/hd.h"

namespace pictura {

constexpr int kNumLongActions = 4;                             // -15, -4, 0, 4 m/s3
constexpr int kNumLatActions = 3;                              // -4, 0, 4 m/s3, positive to the left
constexpr int kNumActions = kNumLongActions * kNumLatActions;  // index = long * 3 + lat
constexpr int32_t kIdleAction = 2 * kNumLatActions + 1;        // no jerk

}  // namespace pictura
