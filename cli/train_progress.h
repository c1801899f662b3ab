// The progress line of training.
#pragma once

#include <string>

#include "pictura/training/loop.h"

namespace pictura {

/// What a person wants to know first comes first, since a terminal cuts the end off: time left, rate, return, what
/// happened in the last update per 1,000 agent-steps, and where its time went.
std::string progress_text(const TrainProgress& progress);

}  // namespace pictura
