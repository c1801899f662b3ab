// Observation arrays on the network's device.
#pragma once

#include <memory>
#include <vector>

#include "pictura/policy/learning_device.h"
#include "pictura/simulator/observation_arrays.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// Arrays of `count` agents for the observed parts, initially zero.
class ObservationRows {
 public:
  ObservationRows(int64_t count, const SimulatorConfig& config) {
    for (const ObservationArray& array : kObservationArrays) {
      static_assert(sizeof(float) == sizeof(int32_t), "all elements have one size");
      const int64_t elements = config.observes(array.part) ? count * array.rows * array.features : 0;
      const size_t bytes = static_cast<size_t>(elements) * sizeof(float);
      arrays_.push_back(elements > 0 ? allocate_bytes(bytes, config.device) : nullptr);
      if (elements > 0) set_to_zero(arrays_.back().get(), bytes, config.device);
    }
  }
  ObservationView rows(int64_t begin, int64_t count) const {
    ObservationView view;
    const std::shared_ptr<std::byte>* array = arrays_.data();
#define X(name, type, rows, features, part, comment)                                                           \
  if (*array) {                                                                                                \
    constexpr int64_t kOfOne = int64_t{rows} * (features);                                                     \
    view.name = {reinterpret_cast<type*>(array->get()) + begin * kOfOne, static_cast<size_t>(count * kOfOne)}; \
  }                                                                                                            \
  ++array;
    PICTURA_OBSERVATION_ARRAYS(X)
#undef X
    return view;
  }

 private:
  std::vector<std::shared_ptr<std::byte>> arrays_;
};

}  // namespace pictura
