// A second implementation of the observation, from docs/reference/observation.md, in double precision. It shares no
// code with the simulator's rules, so that it reveals their faults.
#pragma once

#include <array>
#include <vector>

#include "pictura/simulator/simulator.h"

namespace pictura::testing {

/// A candidate for a row of an entity set. inside_m: distance from the set's range; negative outside.
struct ReferenceRow {
  double distance_m = 0, inside_m = 0;
  std::vector<double> features;
};

struct ReferenceObservation {
  std::vector<double> ego, conditioning, waypoints;
  std::array<std::vector<ReferenceRow>, kNumEntitySets> sets;  // all rows, inside or outside
  bool is_near_lane = false;     // if false, lanes, boundaries, controls and walls are empty
  bool is_within_cells = false;  // if false, some of these rows may be missing
};

/// Returns the observation of a slot's agent, whatever its status. The state must be on the host.
ReferenceObservation reference_observation(Simulator& simulator, int slot);

}  // namespace pictura::testing
