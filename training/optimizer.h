// Optimizer: AdamW (Loshchilov and Hutter, 2019; the paper's) on all parameters, or Muon on the weights of hidden
// layers and AdamW on the rest.
#pragma once

#include <optional>
#include <vector>

#include "pictura/training/muon.h"

namespace pictura {

class Optimizer {
 public:
  /// Creates the optimizer of a policy's parameters, which lie on `device`; calls allocate_gradients(). uses_graphs:
  /// see Muon.
  Optimizer(const Policy& policy, const TrainSection& config, Device device = {}, bool uses_graphs = false);

  /// Norm of the gradients, f32 scalar on their device, without waiting; see rate_factors.
  at::Tensor gradient_norm() const;
  /// Steps along the parameters' gradients, and clears them. failed: f32 scalar on their device; if it is not 0,
  /// neither parameters nor moments change, whatever the gradients are.
  void step(double learning_rate, const at::Tensor& failed);

  /// Gradients of all parameters, in their order: f32 [num_parameters].
  const at::Tensor& gradients() const { return gradients_; }
  /// Sets the gradients to 0.
  void clear_gradients();
  /// Allocates zero gradients, which are parts of one vector and to which backward passes add. Must be called after the
  /// shape of a parameter changes.
  void allocate_gradients();

  /// AdamW's first moments and Muon's momentum, in the order of the policy's parameters.
  std::vector<NamedTensor> first_moments;
  /// Second moments of the parameters that AdamW steps, in their order.
  std::vector<NamedTensor> second_moments;
  /// Factors of AdamW's learning rate, in the order of the policy's parameters: 1 except for weights that move together
  /// (policy/patch_spread.h). The gradient norm scales the squares of their gradients by the same factor. Weight decay
  /// keeps the full rate.
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
