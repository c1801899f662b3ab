#include "pictura/training/patch_spread.h"

#include <algorithm>
#include <cmath>

#include <ATen/core/grad_mode.h>

#include "pictura/common/error.h"
#include "pictura/common/patches.h"
#include "pictura/training/optimizer.h"
#include "pictura/training/weight_average.h"

namespace pictura {

int patch_side_px(int64_t channels) {
  const auto side = static_cast<int>(std::lround(std::sqrt(static_cast<double>(channels) / 3)));
  PICTURA_CHECK(patch_values(side) == channels, "policy: {}: expected 3 p^2 inputs for patches of p px, got {}",
                kFirstConvolution, channels);
  return side;
}

at::Tensor spread_over_patches(const at::Tensor& weight, int factor) {
  return repeat_over_patches(weight, factor) / (double(factor) * factor);
}

at::Tensor repeat_over_patches(const at::Tensor& moments, int factor) {
  const int64_t side = patch_side_px(moments.size(1));
  return moments.unflatten(1, {3, side, side}).repeat_interleave(factor, 2).repeat_interleave(factor, 3).flatten(1, 3);
}

namespace {

size_t first_convolution_among(const std::vector<NamedTensor>& tensors) {
  const auto first = std::find_if(tensors.begin(), tensors.end(),
                                  [](const NamedTensor& tensor) { return tensor.name == kFirstConvolution; });
  PICTURA_CHECK(first != tensors.end(), "policy: its patches cannot grow: it has no parameter '{}'", kFirstConvolution);
  return static_cast<size_t>(first - tensors.begin());
}

}  // namespace

void spread_first_convolution(const Policy& policy, int factor, Optimizer* optimizer_inout,
                              WeightAverage* average_inout) {
  const at::NoGradGuard no_grad;
  const size_t index = first_convolution_among(policy.parameters());
  // In place, so that the network's layer and the list of parameters keep one tensor.
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
