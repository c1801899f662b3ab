#include "pictura/training/optimizer.h"

#include <ATen/core/grad_mode.h>

namespace pictura {

Optimizer::Optimizer(const Policy& policy, const Config::Train& config) : config_(config) {
  const std::vector<NamedTensor>& parameters = policy.parameters();
  gradients_ = at::zeros({policy.num_parameters()}, parameters.front().value.options().requires_grad(false));
  std::vector<at::Tensor> of_muon;
  int64_t begin = 0;
  for (const NamedTensor& parameter : parameters) {
    const at::Tensor& value = parameter.value;
    value.mutable_grad() = gradients_.narrow(0, begin, value.numel()).view(value.sizes());
    begin += value.numel();
    if (config.optimizer == OptimizerKind::muon && is_stepped_by_muon(parameter)) of_muon.push_back(value);
  }
  if (!of_muon.empty()) {
    const bool in_bf16 = gradients_.is_cuda() && !config.reproducible;
    muon_.emplace(std::move(of_muon), in_bf16 ? at::kBFloat16 : at::kFloat, config.weight_decay);
  }
  size_t num_of_muon = 0;
  for (const NamedTensor& parameter : parameters) {
    if (muon_ && is_stepped_by_muon(parameter)) {
      first_moments.push_back({parameter.name, muon_->momentum(num_of_muon++)});
      continue;
    }
    first_moments.push_back({parameter.name, at::zeros_like(parameter.value)});
    second_moments.push_back({parameter.name, at::zeros_like(parameter.value)});
    adamw_values_.push_back(parameter.value);
    adamw_first_moments_.push_back(first_moments.back().value);
    adamw_second_moments_.push_back(second_moments.back().value);
  }
}

void Optimizer::clear_gradients() { gradients_.zero_(); }

Optimizer::Step Optimizer::step(double learning_rate, const at::Tensor& loss, Communicator* communicator) {
  const at::NoGradGuard no_grad;
  // Summed over the ranks and only then scaled down: every rank takes the same step, to the bit.
  communicator->sum(gradients_);
  const at::Tensor norm = gradients_.norm();
  const at::Tensor failed = (norm + loss).isfinite().logical_not().to(at::kFloat);
  gradients_.mul_((config_.max_grad_norm / (norm + 1e-6)).clamp_max(1.0));
  ++steps;
  step_adamw(learning_rate, failed);
  if (muon_) muon_->step(learning_rate, failed);
  clear_gradients();
  return {norm, failed};
}

void Optimizer::step_adamw(double learning_rate, const at::Tensor& failed) {
  std::vector<at::Tensor> gradients;
  for (const at::Tensor& value : adamw_values_) gradients.push_back(value.grad());
  const std::vector<at::Tensor> counts(gradients.size(), at::full({}, static_cast<double>(steps), failed.options()));
  at::_fused_adamw_(adamw_values_, gradients, adamw_first_moments_, adamw_second_moments_, {}, counts, learning_rate,
                    config_.adam_beta1, config_.adam_beta2, config_.weight_decay, config_.adam_eps, /*amsgrad=*/false,
                    /*maximize=*/false, /*grad_scale=*/{}, failed);
}

}  // namespace pictura
