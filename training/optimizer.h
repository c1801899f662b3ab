// Optimizer: AdamW (Loshchilov and Hutter, 2019) on all parameters, as in the paper, or Muon on the weights of hidden
// layers and AdamW on the other parameters.
#pragma once

#include <optional>
#include <vector>

#include "pictura/training/muon.h"

namespace pictura {

class Optimizer {
 public:
  /// Creates the optimizer of a policy's parameters, which are on `device`, and calls allocate_gradients().
  /// uses_graphs: see Muon.
  Optimizer(const Policy& policy, const TrainSection& config, Device device = {}, bool uses_graphs = false);

  /// Returns the norm of the gradients, weighted by rate_factors, as an f32 scalar on their device. Does not wait for
  /// the device.
  at::Tensor gradient_norm() const;
  /// Steps along the parameters' gradients, and clears them. failed: f32 scalar on their device; if it is not 0,
  /// neither parameters nor moments change, whatever the gradients are.
  void step(double learning_rate, const at::Tensor& failed);

  /// Returns the gradients of all parameters, concatenated in the order of the parameters: f32 [num_parameters].
  const at::Tensor& gradients() const { return gradients_; }
  /// Sets the gradients to 0.
  void clear_gradients();
  /// Allocates gradients as parts of one vector, and sets them to 0. Backward passes add to them. Must be called after
  /// the shape of a parameter changes.
  void allocate_gradients();

  /// AdamW's first moments and Muon's momentum, in the order of the policy's parameters.
  std::vector<NamedTensor> first_moments;
  /// Second moments of the parameters that AdamW updates, in the order of the policy's parameters.
  std::vector<NamedTensor> second_moments;
  /// Factors of AdamW's learning rate, in the order of the policy's parameters. A factor is 1, or smaller for a group
  /// of weights that change together (policy/patch_spread.h). gradient_norm() multiplies squares of gradients by the
  /// same factor. Weight decay uses the full rate.
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
