// The lane-to-lane movements of a crossing.
#pragma once

#include <vector>

#include "pictura/map/procedural/layout.h"

namespace pictura::town {

/// Lanes [first_in, first_in + lanes) arriving on one arm continue as lanes [first_out, ...) of another; or the slip
/// lane continues as the outermost one.
struct Movement {
  int from = 0, to = 0;  // arms of the node
  int first_in = 0, first_out = 0, lanes = 1;
  bool is_slip = false;
};

/// The arm into which traffic from `arm` goes straight on; -1: none.
int straight_on(const Node& node, int arm);

/// All movements of a crossing or a fork, grouped by arriving arm, the first of each group starting at the innermost
/// lane. Every arriving lane leads somewhere.
std::vector<Movement> movements_of(const Layout& layout, const Node& node);

}  // namespace pictura::town
