// Constants and functions shared by a network's passes. The functions of tensor_core.cuh must be included before, so
// that a test can emulate them.
#pragma once

#include <cstdint>
#include <type_traits>

namespace pictura::cuda {

constexpr int kWarp = 32, kThreads = 256;  // threads of a warp, and of a block

__device__ inline float to_float(float x) { return x; }
template <typename T>
__device__ T from_float(float x) {
  if constexpr (std::is_same_v<T, float>)
    return x;
  else
    return to_half(x);
}

__device__ inline float gelu(float x) { return 0.5f * x * (1.0f + erff(x * 0.70710678f)); }
// Derivative of gelu(): Phi(x) + x phi(x).
__device__ inline float gelu_derivative(float x) {
  return 0.5f * (1.0f + erff(x * 0.70710678f)) + x * 0.39894228f * __expf(-0.5f * x * x);
}

}  // namespace pictura::cuda
