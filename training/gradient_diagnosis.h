// Diagnosis of an update's gradient: the share of each loss.
#pragma once

#include "pictura/training/chunk_runner.h"

namespace pictura {

struct Learner;

/// Norms of the gradient by each loss alone, with its coefficient.
struct GradientNorms {
  double policy = 0, value = 0, entropy = 0;
};

/// Measures the gradients of single losses, for the log alone, on the first transitions of an update: so few
/// transitions that one forward and three backward passes are at most 3 % of the update's work.
class GradientDiagnosis {
 public:
  /// Measures on the first of these minibatches, whose advantages are set. The parameters' gradients are 0 before and
  /// after. Does not wait for the device.
  void measure(const Minibatch& first, const Minibatches& minibatches, const LossFunction& loss,
               const TrainSection& config, const Learner& learner);
  /// Norms of all ranks. Waits for the device.
  GradientNorms norms() const;

 private:
  at::Tensor norms_;  // f64 [3], in the order of GradientNorms
};

}  // namespace pictura
