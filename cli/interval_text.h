// Estimates for people.
#pragma once

#include <string>

#include "pictura/evaluation/results.h"

namespace pictura {

/// "0.123 +- 0.045": the estimate and the half width of its interval; "-" for a missing estimate.
std::string interval_text(const Estimate& estimate, int decimals = 3);

}  // namespace pictura
