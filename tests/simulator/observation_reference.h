// The observation written a second time, from docs/reference/observation.md: one number after the other, in double,
// over all boxes, lines and pieces of a world. It shares no code with the simulator's rules, which both executors run,
// so that a comparison of executors cannot show a fault in them.
#pragma once

#include <array>
#include <vector>

#include "pictura/simulator/simulator.h"

namespace pictura::testing {

/// What a row of an entity set may show. `inside_m` is how far inside the set's range it is; negative: outside.
struct ReferenceRow {
  double distance_m = 0, inside_m = 0;
  std::vector<double> features;
};

struct ReferenceObservation {
  std::vector<double> ego, conditioning, waypoints;
  std::array<std::vector<ReferenceRow>, kNumEntitySets> sets;  // of all rows, inside or outside
  bool is_near_lane = false;                                   // else lanes, boundaries, controls and walls are empty
  bool is_within_cells = false;                                // else some of these may be missing
};

/// What the agent of a slot observes in the present state, which is on the host. Its status is not looked at.
ReferenceObservation reference_observation(Simulator& simulator, int slot);

}  // namespace pictura::testing
