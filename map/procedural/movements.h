// Movements of a crossing from lanes to lanes.
#pragma once

#include <vector>

#include "pictura/map/procedural/layout.h"

namespace pictura::town {

/// Lanes [first_in, first_in + lanes) of one arm continue as lanes [first_out, first_out + lanes) of another arm. If
/// is_slip, the slip lane continues as the outermost lane.
struct Movement {
  int from = 0, to = 0;  // arms of the node
  int first_in = 0, first_out = 0, lanes = 1;
  bool is_slip = false;
};

/// Returns the arm straight ahead of traffic from `arm`, or -1.
int straight_on(const Node& node, int arm);

/// Returns all movements, grouped by arriving arm. Each group begins with the innermost lane.
std::vector<Movement> movements_of(const Layout& layout, const Node& node);

}  // namespace pictura::town
