// Progress output of training.
#pragma once

#include <string>

#include "pictura/training/loop.h"

namespace pictura {

/// Returns the text of the progress line: remaining time, agent-steps per second of the last minute, return, and
/// driving statistics of the last update. The most important numbers come first, because a terminal cuts off the end.
/// Infractions are collisions at fault, leaving the road, and red lights.
std::string progress_text(const TrainProgress& progress);
/// Returns the share of each phase, and of the rest, in the wall time of an update, such as "simulate 4 %, render 31 %,
/// ..., other 4 %".
std::string phase_shares(const TrainProgress& progress);

}  // namespace pictura
