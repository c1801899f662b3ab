// A second implementation of the observation, from docs/reference/observation.md: number by number, in double, over
// all boxes, lines and pieces of a world. It shares no code with the simulator's rules. Both executors run these rules,
// so a comparison of executors cannot reveal a fault in the rules.
#pragma once

#include <array>
#include <vector>

#include "pictura/simulator/simulator.h"

namespace pictura::testing {

/// A possible row of an entity set. `inside_m` is its distance inside the set's range; negative: outside.
struct ReferenceRow {
  double distance_m = 0, inside_m = 0;
  std::vector<double> features;
};

struct ReferenceObservation {
  std::vector<double> ego, conditioning, waypoints;
  std::array<std::vector<ReferenceRow>, kNumEntitySets> sets;  // all rows, inside or outside
  bool is_near_lane = false;     // otherwise lanes, boundaries, controls and walls are empty
  bool is_within_cells = false;  // otherwise some of these rows may be missing
};

/// Returns the observation of a slot's agent in the present state, which is on the host. Ignores the agent's status.
ReferenceObservation reference_observation(Simulator& simulator, int slot);

}  // namespace pictura::testing
