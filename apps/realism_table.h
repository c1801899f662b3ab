// The table of realism scores.
#pragma once

#include "pictura/evaluation/realism.h"

namespace pictura {

/// Prints it on stdout, and what was left out on stderr.
void print_realism(const RealismReport& report);

}  // namespace pictura
