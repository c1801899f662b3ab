// Exponential average of weights over updates (train.weight_average).
#pragma once

#include "pictura/policy/policy.h"

namespace pictura {

/// Average of a policy's parameters, in f32 on their device. Bit-identical parameters on ranks give bit-identical
/// averages.
class WeightAverage {
 public:
  /// Starts at the parameters of the policy, which must outlive the average. half_life_updates > 0.
  WeightAverage(const Policy& policy, double half_life_updates);

  /// Restarts at the current parameters, with no update averaged.
  void restart();
  /// Adds the parameters after update n: average += w (parameters - average), w = max(1 / n, 1 - 2^(-1 /
  /// half_life_updates)). The average does not include the initial weights; it is first the mean over all updates,
  /// later an exponential average. Does not wait for the device.
  void update();

  std::vector<NamedTensor> values;  // f32, in the order of parameters
  int64_t updates = 0;              // averaged so far

 private:
  const std::vector<NamedTensor>& parameters_;
  double weight_;
};

/// Scope that replaces a policy's parameters in place, and then restores them exactly.
class ReplacedWeights {
 public:
  /// values: in the order of parameters.
  ReplacedWeights(const Policy& policy, const std::vector<NamedTensor>& values);
  ~ReplacedWeights();
  ReplacedWeights(const ReplacedWeights&) = delete;
  ReplacedWeights& operator=(const ReplacedWeights&) = delete;

 private:
  std::vector<at::Tensor> parameters_, own_;
};

}  // namespace pictura
