// Phases of traffic lights without a controller in the file.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

namespace pictura {

/// Returns the first phase whose axis is within 45 degrees of the heading or its opposite, else a new phase.
/// `axes_inout` holds each phase's axis: the heading of its first approach.
inline int32_t phase_of_heading(double heading_rad, std::vector<double>* axes_inout) {
  constexpr double kSameAxis_rad = 0.25 * std::numbers::pi;
  const auto same = std::find_if(axes_inout->begin(), axes_inout->end(), [&](double axis) {
    return std::abs(std::remainder(heading_rad - axis, std::numbers::pi)) <= kSameAxis_rad;
  });
  const auto phase = static_cast<int32_t>(same - axes_inout->begin());
  if (same == axes_inout->end()) axes_inout->push_back(heading_rad);
  return phase;
}

}  // namespace pictura
