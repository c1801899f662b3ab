// Diagnosis of an update's gradient: how much of it each loss makes.
#pragma once

#include "pictura/training/chunk_runner.h"

namespace pictura {

struct Learner;

/// Norms of the gradient by each loss alone, with its coefficient.
struct GradientNorms {
  double policy = 0, value = 0, entropy = 0;
};

/// Measures the gradients of the single losses, for the log alone, on the first transitions of an update: so few that a
/// way there and three back are at most 3 % of the update's work.
class GradientDiagnosis {
 public:
  /// Measures on the first of these minibatches, which has its advantages. The parameters' gradients are 0 before and
  /// after. Nothing waits for the device.
  void measure(const Minibatch& first, const Minibatches& minibatches, const LossFunction& loss,
               const TrainSection& config, const Learner& learner);
  /// Norms of all ranks. Waits for the device.
  GradientNorms norms() const;

 private:
  at::Tensor norms_;  // f64 [3], in the order of GradientNorms
};

}  // namespace pictura
