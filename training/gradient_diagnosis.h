// Gradient norms of single losses, for the log.
#pragma once

#include "pictura/training/chunk_runner.h"

namespace pictura {

struct Learner;

/// Gradient norms of the losses times their coefficients.
struct GradientNorms {
  double policy = 0, value = 0, entropy = 0;
};

/// Measurement on so few transitions that it takes at most 3 % of an update's work.
class GradientDiagnosis {
 public:
  /// first: the first minibatch of `minibatches`, with advantages. The parameters' gradients must be 0, and are 0 again
  /// afterwards. Does not wait for the device.
  void measure(const Minibatch& first, const Minibatches& minibatches, const LossFunction& loss,
               const TrainSection& config, const Learner& learner);
  /// Returns the norms over all ranks. Waits for the device.
  GradientNorms norms() const;

 private:
  at::Tensor norms_;  // f64 [3], in the order of GradientNorms
};

}  // namespace pictura
