// Number of calls in each repeat of a benchmark.
#pragma once

#include <algorithm>

namespace pictura {

/// Returns the number of calls that take repeat_s seconds; at least 1. one_ms: time of a call.
inline int calls_in_repeat(double repeat_s, double one_ms) {
  constexpr double kMaxCalls = 1e9;  // below the maximum of int
  return static_cast<int>(std::clamp(1e3 * repeat_s / one_ms, 1.0, kMaxCalls));
}

}  // namespace pictura
