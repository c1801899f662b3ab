// Round positions along an axis.
#pragma once

#include <vector>

namespace pictura {

/// Returns round positions for axis ticks: a step of 1, 2 or 5 times a power of ten, with about `wanted` ticks within
/// [low, high].
std::vector<double> round_ticks(double low, double high, int wanted);
/// Returns the number of decimals, at most six, that distinguishes ticks at a distance of `step`.
int tick_decimals(double step);

}  // namespace pictura
