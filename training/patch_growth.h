// Growth of the first convolution's patches when images become larger during training, see policy/patch_spread.h.
#pragma once

#include <ATen/ATen.h>

namespace pictura {

class Optimizer;
class Policy;
class WeightAverage;

/// Versions of the functions in policy/patch_spread.h for fp32 tensors on any device.
at::Tensor spread_over_patches(const at::Tensor& weight, int factor);
at::Tensor repeat_over_patches(const at::Tensor& weight, int factor);

/// Spreads the first convolution of a policy in place, together with its optimizer state (moments, rate factor and
/// memory for gradients) and its average, if there is one. No autograd graph and no CUDA graph may refer to the weight.
/// Throws Error if the policy has no such convolution.
void spread_first_convolution(const Policy& policy, int factor, Optimizer* optimizer_inout,
                              WeightAverage* average_inout = nullptr);

}  // namespace pictura
