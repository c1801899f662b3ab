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
  /// Gives the parameters gradients of 0, which are parts of one vector and to which backward passes add.
  Optimizer(const Policy& policy, const Config::Train& config);
  /// Scalars on the parameters' device, which nothing has waited for.
  struct Step {
    at::Tensor norm;    // of the gradients before they were scaled
    at::Tensor failed;  // f32: 1 where it or the loss is not finite, and no step was taken
  };
  /// One step along the parameters' gradients, summed over all ranks and then scaled down to max_grad_norm; clears
  /// them. The loss must be that of all ranks.
  Step step(double learning_rate, const at::Tensor& loss, Communicator* communicator = alone());

  /// Of all parameters, in their order: f32 [num_parameters].
  const at::Tensor& gradients() const { return gradients_; }
  /// Sets them to 0.
  void clear_gradients();

  /// AdamW's first moments and Muon's momentum, in the order of the policy's parameters.
  std::vector<NamedTensor> first_moments;
  /// Of the parameters that AdamW steps, in their order.
  std::vector<NamedTensor> second_moments;
  int64_t steps = 0;

 private:
  void step_adamw(double learning_rate, const at::Tensor& failed);

  Config::Train config_;
  at::Tensor gradients_;
  std::vector<at::Tensor> adamw_values_, adamw_first_moments_, adamw_second_moments_;
  std::optional<Muon> muon_;
};

}  // namespace pictura
