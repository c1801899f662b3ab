#include "pictura/training/weight_average.h"

#include <algorithm>
#include <cmath>

#include <ATen/core/grad_mode.h>

namespace pictura {

namespace {

std::vector<at::Tensor> tensors_of(const std::vector<NamedTensor>& named) {
  std::vector<at::Tensor> tensors;
  for (const NamedTensor& one : named) tensors.push_back(one.value);
  return tensors;
}

}  // namespace

WeightAverage::WeightAverage(const Policy& policy, double half_life_updates)
    : parameters_(policy.parameters()), weight_(1 - std::exp2(-1 / half_life_updates)) {
  for (const NamedTensor& parameter : parameters_) {
    values.push_back({parameter.name, parameter.value.detach().to(at::kFloat, /*non_blocking=*/false, /*copy=*/true)});
  }
}

void WeightAverage::restart() {
  const at::NoGradGuard no_grad;
  for (size_t i = 0; i < values.size(); ++i) values[i].value.copy_(parameters_[i].value);
  updates = 0;
}

void WeightAverage::update() {
  const at::NoGradGuard no_grad;
  ++updates;
  at::_foreach_lerp_(tensors_of(values), tensors_of(parameters_), std::max(1 / static_cast<double>(updates), weight_));
}

ReplacedWeights::ReplacedWeights(const Policy& policy, const std::vector<NamedTensor>& values)
    : parameters_(tensors_of(policy.parameters())) {
  const at::NoGradGuard no_grad;
  for (size_t i = 0; i < parameters_.size(); ++i) {
    own_.push_back(parameters_[i].clone());
    parameters_[i].copy_(values[i].value);
  }
}

ReplacedWeights::~ReplacedWeights() {
  const at::NoGradGuard no_grad;
  for (size_t i = 0; i < parameters_.size(); ++i) parameters_[i].copy_(own_[i]);
}

}  // namespace pictura
