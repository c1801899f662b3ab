#include "pictura/training/patch_growth.h"

#include <algorithm>

#include <ATen/core/grad_mode.h>

#include "pictura/common/error.h"
#include "pictura/policy/patch_spread.h"
#include "pictura/policy/saved_policy.h"
#include "pictura/training/optimizer.h"
#include "pictura/training/weight_average.h"

namespace pictura {

namespace {

size_t first_convolution_among(const std::vector<NamedTensor>& tensors) {
  const auto first = std::find_if(tensors.begin(), tensors.end(),
                                  [](const NamedTensor& tensor) { return tensor.name == kFirstConvolution; });
  PICTURA_CHECK(first != tensors.end(), "policy: its patches cannot grow: it has no parameter '{}'", kFirstConvolution);
  return static_cast<size_t>(first - tensors.begin());
}

// Applies a function of stored tensors to a tensor.
template <typename F>
at::Tensor applied(const at::Tensor& tensor, const F& f) {
  const StoredTensor result = f(to_stored({{kFirstConvolution, tensor}}).front());
  return to_tensors({result}).front().value.to(tensor.options());
}

}  // namespace

at::Tensor spread_over_patches(const at::Tensor& weight, int factor) {
  return applied(weight, [factor](const StoredTensor& stored) { return spread_over_patches(stored, factor); });
}

at::Tensor repeat_over_patches(const at::Tensor& weight, int factor) {
  return applied(weight, [factor](const StoredTensor& stored) { return repeat_over_patches(stored, factor); });
}

void spread_first_convolution(const Policy& policy, int factor, Optimizer* optimizer_inout,
                              WeightAverage* average_inout) {
  const at::NoGradGuard no_grad;
  const size_t index = first_convolution_among(policy.parameters());
  // Replaced in place, so that the network's layer and the list of parameters still share one tensor.
  const at::Tensor& weight = policy.parameters()[index].value;
  weight.set_data(spread_over_patches(weight, factor));
  for (std::vector<NamedTensor>* moments : {&optimizer_inout->first_moments, &optimizer_inout->second_moments}) {
    at::Tensor& moment = (*moments)[first_convolution_among(*moments)].value;
    moment = repeat_over_patches(moment, factor);
  }
  optimizer_inout->rate_factors[index] *= rate_factor_of_spread(factor);
  optimizer_inout->allocate_gradients();
  if (!average_inout) return;
  at::Tensor& average = average_inout->values[index].value;
  average = spread_over_patches(average, factor);
}

}  // namespace pictura
