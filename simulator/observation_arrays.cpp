#include "pictura/simulator/observation_arrays.h"

namespace pictura {

std::vector<NamedArray> observation_arrays(const ObservationView& observations, int num_slots, Device device) {
  std::vector<NamedArray> arrays;
#define X(name, type, rows, features, part, comment)                                                 \
  if (!observations.name.empty()) {                                                                  \
    arrays.push_back({#name, Array(observations.name.data(), {num_slots, rows, features}, device)}); \
  }
  PICTURA_OBSERVATION_ARRAYS(X)
#undef X
  return arrays;
}

}  // namespace pictura
