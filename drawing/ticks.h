// Round positions along an axis.
#pragma once

#include <vector>

namespace pictura {

/// Round positions for axis ticks: a step of 1, 2 or 5 times a power of ten, about `wanted` of them within [low, high].
std::vector<double> round_ticks(double low, double high, int wanted);
/// The number of decimals, at most six, that distinguishes ticks which are `step` apart.
int tick_decimals(double step);

}  // namespace pictura
