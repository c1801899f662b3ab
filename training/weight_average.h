// Exponential average of a policy's weights over updates (train.weight_average), which smooths the noise of single
// updates.
#pragma once

#include "pictura/policy/policy.h"

namespace pictura {

/// Average of a policy's parameters, in f32 on their device. It is computed elementwise, so ranks with bit-identical
/// parameters have bit-identical averages.
class WeightAverage {
 public:
  /// Starts the average at the policy's current parameters. The policy must outlive it; half_life_updates > 0.
  WeightAverage(const Policy& policy, double half_life_updates);

  /// Restarts the average at the policy's parameters, as if no update had been averaged.
  void restart();
  /// Adds the parameters after an update: average += w (parameters - average), with w = max(1 / n, 1 - 2^(-1 /
  /// half_life_updates)) for the n-th update. After the first update the average equals the parameters, then it is the
  /// mean over all updates, and finally an exponential average. The average never includes initial weights, which are
  /// noise. Does not wait for the device.
  void update();

  std::vector<NamedTensor> values;  // f32, in the order of the policy's parameters
  int64_t updates = 0;              // number of updates averaged so far

 private:
  const std::vector<NamedTensor>& parameters_;
  double weight_;
};

/// Scope that replaces a policy's parameters in place, and restores them exactly at its end.
class ReplacedWeights {
 public:
  /// Replaces the parameters by `values`, in the order of the policy's parameters.
  ReplacedWeights(const Policy& policy, const std::vector<NamedTensor>& values);
  ~ReplacedWeights();
  ReplacedWeights(const ReplacedWeights&) = delete;
  ReplacedWeights& operator=(const ReplacedWeights&) = delete;

 private:
  std::vector<at::Tensor> parameters_, own_;
};

}  // namespace pictura
