// Constants and functions shared by a network's passes.
#pragma once

namespace pictura::cuda {

constexpr int kWarp = 32;

__device__ inline float gelu(float x) { return 0.5f * x * (1.0f + erff(x * 0.70710678f)); }
// Derivative of gelu(): Phi(x) + x phi(x).
__device__ inline float gelu_derivative(float x) {
  return 0.5f * (1.0f + erff(x * 0.70710678f)) + x * 0.39894228f * __expf(-0.5f * x * x);
}

}  // namespace pictura::cuda
