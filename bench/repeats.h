// How many calls a benchmark takes in each of its repeats.
#pragma once

#include <algorithm>

namespace pictura {

/// As many as last `repeat_s`, when one takes `one_ms`, but at least one.
inline int calls_in_repeat(double repeat_s, double one_ms) {
  constexpr double kMaxCalls = 1e9;  // more than any repeat needs, and below the maximum of an int
  return static_cast<int>(std::clamp(1e3 * repeat_s / one_ms, 1.0, kMaxCalls));
}

}  // namespace pictura
