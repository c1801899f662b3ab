// Which lanes lead where at a crossing.
#pragma once

#include <vector>

#include "pictura/map/procedural/layout.h"

namespace pictura::town {

/// Lanes [first_in, first_in + lanes) of those who arrive on one arm go on as lanes [first_out, ...) of another; or the
/// slip lane as the outermost one.
struct Movement {
  int from = 0, to = 0;  // arms of the node
  int first_in = 0, first_out = 0, lanes = 1;
  bool is_slip = false;
};

/// The arm on which traffic from `arm` goes straight on, -1: none.
int straight_on(const Node& node, int arm);

/// All movements of a crossing, from every arm to every other, those from one arm next to each other and the first of
/// them beginning at the innermost lane. Every lane that arrives leads somewhere.
std::vector<Movement> movements_of(const Layout& layout, const Node& node);

}  // namespace pictura::town
