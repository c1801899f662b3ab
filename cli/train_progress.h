// What training prints about its progress.
#pragma once

#include <string>

#include "pictura/training/loop.h"

namespace pictura {

/// What a person wants to know first comes first, since a terminal cuts the end off: time left, the last minute's rate,
/// return, and how the agents drove in the last update. Infractions are collisions at fault, off-roads and red lights.
std::string progress_text(const TrainProgress& progress);
/// "simulate 4 %, render 31 %, ..., other 4 %": each phase, and what is in none, of the update's wall time.
std::string phase_shares(const TrainProgress& progress);

}  // namespace pictura
