// Ticks of an axis at round numbers.
#pragma once

#include <vector>

namespace pictura {

/// Returns about `wanted` ticks within [low, high]. Their distance is 1, 2 or 5 times a power of ten.
std::vector<double> round_ticks(double low, double high, int wanted);
/// Returns the number of decimals, at most six, that distinguishes ticks `step` apart.
int tick_decimals(double step);

}  // namespace pictura
