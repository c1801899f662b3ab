// A second implementation of the observation, written from docs/reference/observation.md. It computes each number in
// double precision, from all boxes, lines and pieces of a world. It shares no code with the simulator's rules. The CPU
// and CUDA simulators share the rules, so a comparison of the simulators cannot reveal a fault in the rules.
#pragma once

#include <array>
#include <vector>

#include "pictura/simulator/simulator.h"

namespace pictura::testing {

/// A candidate for a row of an entity set. inside_m is how far the entity is inside the set's range; it is negative
/// outside the range.
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

/// Returns the observation of a slot's agent in the current state, which must be on the host. Ignores the agent's
/// status.
ReferenceObservation reference_observation(Simulator& simulator, int slot);

}  // namespace pictura::testing
