// Phases of lights that no controller of the file controls.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

namespace pictura {

/// The phase of an approach of a junction: that of the first approach whose heading, or its opposite, differs by at
/// most 45 degrees, else a new one. `axes_inout` holds the heading of the first approach of each phase, in radians.
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
