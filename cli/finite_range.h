// Ranges that numbers of options must lie in, NaN and infinity refused: CLI11's own take NaN for a number of any range.
#pragma once

#include <CLI/CLI.hpp>

namespace pictura {

/// Takes finite numbers from low to high, both included.
CLI::Validator finite_range(double low, double high);

}  // namespace pictura
