// Text of confidence intervals.
#pragma once

#include <string>

#include "pictura/evaluation/results.h"

namespace pictura {

/// Returns an estimate and its half width, such as "0.123 +- 0.045". A missing number becomes "-".
std::string interval_text(const Estimate& estimate, int decimals = 3);

}  // namespace pictura
