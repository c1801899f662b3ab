// Names, types and shapes of an observation's arrays, generated from the list in observation.h.
#pragma once

#include <string_view>
#include <vector>

#include "pictura/common/array.h"
#include "pictura/simulator/observation.h"

namespace pictura {

/// Name, type and shape of one array of an observation.
struct ObservationArray {
  std::string_view name;
  ElementType type;
  int rows = 1, features = 0;
  ObservationPart part;
};

/// All possible arrays of an observation, in the order of the list.
constexpr ObservationArray kObservationArrays[] = {
#define X(name, type, rows, features, part, comment) {#name, element_type<type>(), rows, features, part},
    PICTURA_OBSERVATION_ARRAYS(X)
#undef X
};

/// Returns the arrays that are present (not empty), each [slots, rows, features], in the order of the list.
std::vector<NamedArray> observation_arrays(const ObservationView& observations, int num_slots, Device device);

}  // namespace pictura
