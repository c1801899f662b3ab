// Diagnosis of an update's gradient: the norm of each loss's gradient.
#pragma once

#include "pictura/training/chunk_runner.h"

namespace pictura {

struct Learner;

/// Norms of the gradients of single losses, each multiplied by its coefficient.
struct GradientNorms {
  double policy = 0, value = 0, entropy = 0;
};

/// Measures, only for the log, the gradients of single losses. It uses so few of an update's first transitions that one
/// forward and three backward passes are at most 3 % of the update's work.
class GradientDiagnosis {
 public:
  /// Measures on `first`, the first of `minibatches`. The advantages of `first` must be set. The parameters' gradients
  /// must be 0, and are 0 again afterwards. Does not wait for the device.
  void measure(const Minibatch& first, const Minibatches& minibatches, const LossFunction& loss,
               const TrainSection& config, const Learner& learner);
  /// Returns the norms over all ranks. Waits for the device.
  GradientNorms norms() const;

 private:
  at::Tensor norms_;  // f64 [3], in the order of GradientNorms
};

}  // namespace pictura
