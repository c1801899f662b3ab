// Phases of traffic lights that no controller of the map's file controls. Lights of one phase are green together.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

namespace pictura {

/// Returns the phase of a junction's approach with this heading. It is the first phase whose axis differs from the
/// heading, or from the opposite heading, by at most 45 degrees. If there is none, a new phase is appended.
/// `axes_inout` holds the axis of each phase: the heading, in radians, of its first approach.
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
