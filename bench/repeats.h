// Number of calls in each repeat of a benchmark.
#pragma once

#include <algorithm>

namespace pictura {

/// Returns the number of calls that last `repeat_s`, when one takes `one_ms`; at least one.
inline int calls_in_repeat(double repeat_s, double one_ms) {
  constexpr double kMaxCalls = 1e9;  // above the need of any repeat, and below the maximum of int
  return static_cast<int>(std::clamp(1e3 * repeat_s / one_ms, 1.0, kMaxCalls));
}

}  // namespace pictura
