// Movements of a crossing: which lanes continue as which other lanes.
#pragma once

#include <vector>

#include "pictura/map/procedural/layout.h"

namespace pictura::town {

/// A movement: lanes [first_in, first_in + lanes) of one arm continue as lanes [first_out, first_out + lanes) of
/// another arm. If is_slip, the slip lane continues as the outermost lane.
struct Movement {
  int from = 0, to = 0;  // arms of the node
  int first_in = 0, first_out = 0, lanes = 1;
  bool is_slip = false;
};

/// Returns the arm into which traffic from `arm` goes straight on, or -1 if there is none.
int straight_on(const Node& node, int arm);

/// Returns all movements of a crossing or a fork, grouped by arriving arm. The first movement of each group starts at
/// the innermost lane. Every arriving lane has a movement.
std::vector<Movement> movements_of(const Layout& layout, const Node& node);

}  // namespace pictura::town
