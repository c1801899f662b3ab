// Progress output of training.
#pragma once

#include <string>

#include "pictura/training/loop.h"

namespace pictura {

/// Text of the progress line, most important numbers first, since a terminal cuts off the end: time left, the last
/// minute's rate, return, and driving statistics of the last update. Infractions are collisions at fault, off-roads and
/// red lights.
std::string progress_text(const TrainProgress& progress);
/// Shares of each phase, and of the rest, in the update's wall time: "simulate 4 %, render 31 %, ..., other 4 %".
std::string phase_shares(const TrainProgress& progress);

}  // namespace pictura
