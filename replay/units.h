// Conversion to the whole units of replays.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

namespace pictura {

/// Returns the nearest whole number of units, clamped to int32.
inline int32_t in_units(double value, double unit) {
  constexpr double kMost = std::numeric_limits<int32_t>::max();
  return static_cast<int32_t>(std::lround(std::clamp(value / unit, -kMost, kMost)));
}

inline int32_t centimetres(float value_m) { return in_units(100 * double{value_m}, 1); }

inline int32_t tenths_of_degree(float angle_rad) { return in_units(1800 / std::numbers::pi * double{angle_rad}, 1); }

}  // namespace pictura
