// Growth of the first convolution's patches during training (policy/patch_spread.h).
#pragma once

#include <ATen/ATen.h>

namespace pictura {

class Optimizer;
class Policy;
class WeightAverage;

/// Variants of the functions in policy/patch_spread.h for fp32 tensors on any device.
at::Tensor spread_over_patches(const at::Tensor& weight, int factor);
at::Tensor repeat_over_patches(const at::Tensor& weight, int factor);

/// Spreads a policy's first convolution, its optimizer state and its average in place. No autograd graph or CUDA graph
/// may refer to the weight. Throws Error if the policy has no such convolution.
void spread_first_convolution(const Policy& policy, int factor, Optimizer* optimizer_inout,
                              WeightAverage* average_inout = nullptr);

}  // namespace pictura
