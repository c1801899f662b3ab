#include "pictura/training/optimizer.h"

#include <map>

#include <ATen/core/grad_mode.h>

namespace pictura {

Optimizer::Optimizer(const Policy& policy, const TrainSection& config, Device device, bool uses_graphs)
    : rate_factors(policy.parameters().size(), 1), parameters_(policy.parameters()), config_(config) {
  allocate_gradients();
  std::vector<at::Tensor> of_muon;
  for (const NamedTensor& parameter : parameters_) {
    if (config.optimizer == OptimizerKind::muon && is_stepped_by_muon(parameter)) of_muon.push_back(parameter.value);
  }
  if (!of_muon.empty()) {
    const bool in_bf16 = gradients_.is_cuda() && !config.reproducible;
    muon_.emplace(std::move(of_muon), in_bf16 ? at::kBFloat16 : at::kFloat, config.weight_decay, device, uses_graphs);
  }
  size_t num_of_muon = 0;
  for (size_t i = 0; i < parameters_.size(); ++i) {
    const auto& [name, value] = parameters_[i];
    first_moments.push_back({name, is_of_muon(i) ? muon_->momentum(num_of_muon++) : at::zeros_like(value)});
    if (!is_of_muon(i)) second_moments.push_back({name, at::zeros_like(value)});
  }
}

void Optimizer::allocate_gradients() {
  int64_t size = 0;
  for (const NamedTensor& parameter : parameters_) size += parameter.value.numel();
  gradients_ = at::zeros({size}, parameters_.front().value.options().requires_grad(false));
  int64_t begin = 0;
  for (const NamedTensor& parameter : parameters_) {
    const at::Tensor& value = parameter.value;
    value.mutable_grad() = gradients_.narrow(0, begin, value.numel()).view(value.sizes());
    begin += value.numel();
  }
  if (muon_) muon_->discard_graph();
}

void Optimizer::clear_gradients() { gradients_.zero_(); }

at::Tensor Optimizer::gradient_norm() const {
  at::Tensor norm = gradients_.norm();
  // Weights that change together count as one weight, because each has the gradient of that one weight.
  for (size_t i = 0; i < parameters_.size(); ++i) {
    if (rate_factors[i] == 1) continue;
    norm = (norm.square() - (1 - rate_factors[i]) * parameters_[i].value.grad().square().sum()).sqrt();
  }
  return norm;
}

void Optimizer::step(double learning_rate, const at::Tensor& failed) {
  const at::NoGradGuard no_grad;
  ++steps;
  step_adamw(learning_rate, failed);
  if (muon_) muon_->step(learning_rate, failed);
  clear_gradients();
}

void Optimizer::step_adamw(double learning_rate, const at::Tensor& failed) {
  struct Group {
    std::vector<at::Tensor> values, gradients, first, second;
  };
  std::map<double, Group> groups;  // by rate factor
  size_t num_of_adamw = 0;
  for (size_t i = 0; i < parameters_.size(); ++i) {
    if (is_of_muon(i)) continue;
    Group& group = groups[rate_factors[i]];
    group.values.push_back(parameters_[i].value);
    group.gradients.push_back(parameters_[i].value.grad());
    group.first.push_back(first_moments[i].value);
    group.second.push_back(second_moments[num_of_adamw++].value);
  }
  for (const auto& [factor, group] : groups) {
    const std::vector<at::Tensor> counts(group.values.size(),
                                         at::full({}, static_cast<double>(steps), failed.options()));
    // AdamW multiplies the weight decay by the learning rate, which contains the factor, so the decay is divided by the
    // factor.
    at::_fused_adamw_(group.values, group.gradients, group.first, group.second, {}, counts, learning_rate * factor,
                      config_.adam_beta1, config_.adam_beta2, config_.weight_decay / factor, config_.adam_eps,
                      /*amsgrad=*/false, /*maximize=*/false, /*grad_scale=*/{}, failed);
  }
}

}  // namespace pictura
