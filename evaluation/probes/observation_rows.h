// Memory on the network's device for agents' observations.
#pragma once

#include <vector>

#include "pictura/policy/torch_device.h"
#include "pictura/simulator/observation_arrays.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// Observation arrays of `count` agents, for the parts that a simulator observes.
class ObservationRows {
 public:
  ObservationRows(int64_t count, const SimulatorConfig& config) {
    for (const ObservationArray& array : kObservationArrays) {
      const auto type = array.type == ElementType::f32 ? at::kFloat : at::kInt;
      arrays_.push_back(config.observes(array.part)
                            ? at::zeros({count, array.rows * array.features},
                                        at::TensorOptions(type).device(torch_device(config.device)))
                            : at::Tensor());
    }
  }
  ObservationView rows(int64_t begin, int64_t count) const {
    ObservationView view;
    const at::Tensor* array = arrays_.data();
#define X(name, type, rows, features, part, comment)                               \
  if (array->defined()) view.name = span_of<type>(array->narrow(0, begin, count)); \
  ++array;
    PICTURA_OBSERVATION_ARRAYS(X)
#undef X
    return view;
  }

 private:
  std::vector<at::Tensor> arrays_;
};

}  // namespace pictura
