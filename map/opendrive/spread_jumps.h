// Jumps of a reference line, in plan and in height, spread over the road around them.
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "pictura/map/opendrive/model.h"

namespace pictura::opendrive {

/// A geometry that begins elsewhere than the one before it ends.
struct Jump {
  std::size_t piece = 0;          // the index of the geometry
  Eigen::Vector2d shift_m{0, 0};  // from the end of the one before
};

/// Whether a road is long enough for a jump: spread over it, the jump turns the line by at most 0.2 rad.
bool can_spread_jump(double jump_m, double road_length_m);

/// Moves the line around each jump, so that it has none: before it towards what follows, and after it towards what came
/// before, as a smoothstep of s over ten metres, or ten times the jump if that is more, or the whole of a shorter road.
/// Stations and both ends of the road stay. Jumps are in the order of their pieces.
void spread_jumps(const std::vector<Jump>& jumps, FileRoad* road);

/// A step of a road's elevation at s.
struct HeightJump {
  double s = 0, rise_m = 0;
};

/// Changes the elevation around each jump as spread_jumps() does the line.
void spread_height_jumps(const std::vector<HeightJump>& jumps, FileRoad* road);

}  // namespace pictura::opendrive
