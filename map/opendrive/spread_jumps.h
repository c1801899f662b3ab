// Smooths jumps of a reference line, in plan and in height, over the adjacent parts of the road.
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "pictura/map/opendrive/model.h"

namespace pictura::opendrive {

/// A jump: the start of a geometry differs from the end of the previous geometry.
struct Jump {
  std::size_t piece = 0;          // index of the geometry
  Eigen::Vector2d shift_m{0, 0};  // from the end of the previous geometry to the start of this one
};

/// Whether a road is long enough for smoothing a jump: spread over the whole road, the jump turns the line by at most
/// 0.2 rad.
bool can_spread_jump(double jump_m, double road_length_m);

/// Moves the reference line around each jump so that the jump vanishes. Before a jump, the line moves towards the
/// following geometry, and after it towards the preceding geometry. The shift is a smoothstep of s over ten metres, or
/// over ten times the jump if that is longer, but at most over the whole road. Stations and both ends of the road do
/// not change. `jumps` must be in the order of their pieces.
void spread_jumps(const std::vector<Jump>& jumps, FileRoad* road);

/// A step of a road's elevation at s.
struct HeightJump {
  double s = 0, rise_m = 0;
};

/// Smooths the elevation around each jump as spread_jumps() smooths the line.
void spread_height_jumps(const std::vector<HeightJump>& jumps, FileRoad* road);

}  // namespace pictura::opendrive
