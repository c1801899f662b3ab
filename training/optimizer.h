// Optimizer: AdamW (Loshchilov and Hutter, 2019; the paper's) on all parameters, or Muon on the weights of hidden
// layers and AdamW on the rest.
#pragma once

#include <optional>
#include <vector>

#include "pictura/training/muon.h"

namespace pictura {

class Optimizer {
 public:
  /// Optimizer of a policy's parameters, which lie on `device`; calls allocate_gradients(). uses_graphs: see Muon.
  Optimizer(const Policy& policy, const TrainSection& config, Device device = {}, bool uses_graphs = false);

  /// Norm of the gradients, f32 scalar on their device, which nothing waits for; see rate_factors.
  at::Tensor gradient_norm() const;
  /// Steps along the parameters' gradients, and clears them. failed: f32 scalar on their device; where it is not 0,
  /// neither parameters nor moments change, whatever the gradients are.
  void step(double learning_rate, const at::Tensor& failed);

  /// Gradients of all parameters, in their order: f32 [num_parameters].
  const at::Tensor& gradients() const { return gradients_; }
  /// Sets the gradients to 0.
  void clear_gradients();
  /// Allocates gradients of 0, which are parts of one vector and to which backward passes add. Must be called after a
  /// parameter has taken another shape.
  void allocate_gradients();

  /// AdamW's first moments and Muon's momentum, in the order of the policy's parameters.
  std::vector<NamedTensor> first_moments;
  /// Second moments of the parameters that AdamW steps, in their order.
  std::vector<NamedTensor> second_moments;
  /// Factors of AdamW's learning rate, in the order of the policy's parameters: 1 but for weights that move together
  /// (policy/patch_spread.h), whose squares the gradient's norm counts by the same factor. Weight decay keeps the
  /// whole rate.
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
