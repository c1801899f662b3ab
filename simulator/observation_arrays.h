// Names, types and shapes of an observation's arrays.
#pragma once

#include <string_view>
#include <vector>

#include "pictura/common/array.h"
#include "pictura/simulator/observation.h"

namespace pictura {

struct ObservationArray {
  std::string_view name;
  ElementType type;
  int rows = 1, features = 0;
  ObservationPart part;
};

/// Descriptions of all observation arrays.
constexpr ObservationArray kObservationArrays[] = {
#define X(name, type, rows, features, part, comment) {#name, element_type<type>(), rows, features, part},
    PICTURA_OBSERVATION_ARRAYS(X)
#undef X
};

/// Returns the nonempty arrays, each [slots, rows, features].
std::vector<NamedArray> observation_arrays(const ObservationView& observations, int num_slots, Device device);

}  // namespace pictura
