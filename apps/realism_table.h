// The table of realism scores.
#pragma once

#include "pictura/evaluation/realism.h"

namespace pictura {

/// Prints the table on stdout, and on stderr what was left out.
void print_realism(const RealismReport& report);

}  // namespace pictura
