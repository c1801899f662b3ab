// Progress output of training.
#pragma once

#include <string>

#include "pictura/training/loop.h"

namespace pictura {

/// Returns the progress line, the most important numbers first. Infractions are at-fault collisions, leaving the road,
/// and red lights.
std::string progress_text(const TrainProgress& progress);
/// Returns shares of an update's wall time, such as "simulate 4 %, render 31 %, ..., other 4 %".
std::string phase_shares(const TrainProgress& progress);

}  // namespace pictura
