// The discrete action space (paper, policy architecture): an action is one of 4 longitudinal jerks combined with one of
// 3 lateral jerks.
#pragma once

#include "pictura/common/portable/hd.h"

namespace pictura {

constexpr int kNumLongActions = 4;                             // jerk -15, -4, 0, 4 m/s3
constexpr int kNumLatActions = 3;                              // jerk -4, 0, 4 m/s3, positive to the left
constexpr int kNumActions = kNumLongActions * kNumLatActions;  // index = long * 3 + lat
constexpr int32_t kIdleAction = 2 * kNumLatActions + 1;        // no jerk

}  // namespace pictura
