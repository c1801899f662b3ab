// The first convolution of a policy that is being trained, where its images become larger: see policy/patch_spread.h.
#pragma once

namespace pictura {

class Optimizer;
class Policy;
class WeightAverage;

/// Spreads the first convolution of a policy, in place, what its optimizer keeps of it (moments, rate factor and memory
/// for gradients), and its average, if there is one. No graph of autograd or CUDA may hold the weight. Throws Error
/// where the policy has no such convolution.
void spread_first_convolution(const Policy& policy, int factor, Optimizer* optimizer_inout,
                              WeightAverage* average_inout = nullptr);

}  // namespace pictura
