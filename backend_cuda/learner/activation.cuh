// What a network's passes have in common.
#pragma once

namespace pictura::cuda {

constexpr int kWarp = 32;
constexpr float kNormEpsilon = 1e-5f;

__device__ inline float gelu(float x) { return 0.5f * x * (1.0f + erff(x * 0.70710678f)); }
// Phi(x) + x phi(x).
__device__ inline float gelu_derivative(float x) {
  return 0.5f * (1.0f + erff(x * 0.70710678f)) + x * 0.39894228f * __expf(-0.5f * x * x);
}

}  // namespace pictura::cuda
