// Table of realism scores.
#pragma once

#include "pictura/evaluation/realism.h"

namespace pictura {

/// Prints the table on stdout, and warnings about omitted scenes and rollouts on stderr.
void print_realism(const RealismReport& report);

}  // namespace pictura
