// Table of realism scores.
#pragma once

#include "pictura/evaluation/realism.h"

namespace pictura {

/// Prints on stdout, and warns on stderr about omitted scenes and rollouts.
void print_realism(const RealismReport& report);

}  // namespace pictura
