// The step of an update's optimizer: AdamW (Loshchilov and Hutter, 2019; the paper's) on all parameters, or Muon on the
// weights of hidden layers and AdamW on the rest.
#pragma once

#include <optional>
#include <vector>

#include "pictura/training/muon.h"
#include "pictura/training/ranks/communicator.h"

namespace pictura {

class Optimizer {
 public:
  /// Gives the parameters, which lie on `device`, gradients as allocate_gradients() does. uses_graphs: see Muon.
  Optimizer(const Policy& policy, const TrainSection& config, Device device = {}, bool uses_graphs = false);
  /// Scalars on the parameters' device, which nothing has waited for.
  struct Step {
    at::Tensor norm;    // of the gradients before they were scaled, see rate_factors
    at::Tensor failed;  // f32: 1 where it or the loss is not finite, and no step was taken
  };
  /// One step along the parameters' gradients, summed over all ranks and then scaled down to max_grad_norm; clears
  /// them. The loss must be that of all ranks.
  Step step(double learning_rate, const at::Tensor& loss, Communicator* communicator = alone());

  /// Gradients of all parameters, in their order: f32 [num_parameters].
  const at::Tensor& gradients() const { return gradients_; }
  /// Sets them to 0.
  void clear_gradients();
  /// Gives the parameters gradients of 0, which are parts of one vector and to which backward passes add. Must be
  /// called after a parameter has taken another shape.
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
