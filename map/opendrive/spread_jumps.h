// Smooths jumps of a reference line, in plan and in height.
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "pictura/map/opendrive/model.h"

namespace pictura::opendrive {

/// A jump between the end of a geometry and the start of the next geometry.
struct Jump {
  std::size_t piece = 0;          // index of the next geometry
  Eigen::Vector2d shift_m{0, 0};  // from the previous geometry's end to the next geometry's start
};

/// Whether the jump, spread over the whole road, turns the line by at most 0.2 rad.
bool can_spread_jump(double jump_m, double road_length_m);

/// Moves the reference line around each jump so that the jump vanishes. The shift is a smoothstep of s over ten metres,
/// or over ten times the jump if longer, but at most over the road. Stations and both ends of the road do not change.
/// `jumps` must be in the order of their pieces.
void spread_jumps(const std::vector<Jump>& jumps, FileRoad* road);

/// A step of a road's elevation at s.
struct HeightJump {
  double s = 0, rise_m = 0;
};

/// Smooths the elevation as spread_jumps() smooths the line.
void spread_height_jumps(const std::vector<HeightJump>& jumps, FileRoad* road);

}  // namespace pictura::opendrive
