// Optimizer: AdamW (Loshchilov and Hutter, 2019), as in the paper, or Muon on the weights of hidden layers and AdamW on
// the rest.
#pragma once

#include <optional>
#include <vector>

#include "pictura/training/muon.h"

namespace pictura {

class Optimizer {
 public:
  /// Optimizes a policy on `device`. uses_graphs: see Muon.
  Optimizer(const Policy& policy, const TrainSection& config, Device device = {}, bool uses_graphs = false);

  /// Returns the norm, weighted by rate_factors, as an f32 scalar on the device. Does not wait for the device.
  at::Tensor gradient_norm() const;
  /// Steps along the gradients, and clears them. failed: f32 scalar on the device; if it is not 0, parameters and
  /// moments stay unchanged.
  void step(double learning_rate, const at::Tensor& failed);

  /// Gradients of all parameters, concatenated: f32 [num_parameters].
  const at::Tensor& gradients() const { return gradients_; }
  void clear_gradients();
  /// Allocates gradients of 0 in one vector. Call it after a parameter's shape changes.
  void allocate_gradients();

  /// AdamW's first moments and Muon's momentum, in the order of parameters.
  std::vector<NamedTensor> first_moments;
  /// Second moments of AdamW's parameters, in the order of parameters.
  std::vector<NamedTensor> second_moments;
  /// Factors of AdamW's learning rate, in the order of parameters: 1, or less for weights that change together
  /// (policy/patch_spread.h). gradient_norm() multiplies squares of gradients by them; weight decay ignores them.
  std::vector<double> rate_factors;
  int64_t steps = 0;

 private:
  bool is_of_muon(size_t parameter) const { return muon_ && is_stepped_by_muon(parameters_[parameter]); }
  void step_adamw(double learning_rate, const at::Tensor& failed);

  const std::vector<NamedTensor>& parameters_;
  TrainSection config_;
  at::Tensor gradients_;
  std::optional<Muon> muon_;
};

}  // namespace pictura
