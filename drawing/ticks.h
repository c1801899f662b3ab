// Positions of ticks along an axis, at round numbers.
#pragma once

#include <vector>

namespace pictura {

/// Returns about `wanted` positions of axis ticks within [low, high]. Their distance is 1, 2 or 5 times a power of ten.
std::vector<double> round_ticks(double low, double high, int wanted);
/// Returns the number of decimals, at most six, with which labels distinguish ticks at a distance of `step`.
int tick_decimals(double step);

}  // namespace pictura
