// Kernels that normalize rows of activations, and their backward passes. The lanes of a warp process one or more rows
// together, each lane vectors of neighbouring channels. Sums are in fp32 in a fixed order.
#pragma once

#include "pictura/backend_cuda/learner/activation.cuh"
#include "pictura/policy/rules/network_passes.h"

namespace pictura::cuda::row_norms {

/// Part of a row of kChannels channels that a lane holds: its vectors are kLanes vectors apart.
template <int kChannels>
struct RowPart {
  static constexpr int kWidth = 8;  // channels of a vector
  static constexpr int kVectorsOfRow = kChannels / kWidth;
  /// Lanes that share a row: the largest power of two that divides the vectors, at most a warp.
  static constexpr int kLanes = (kVectorsOfRow & -kVectorsOfRow) < kWarp ? kVectorsOfRow & -kVectorsOfRow : kWarp;
  static constexpr int kRows = kWarp / kLanes;  // rows that a warp processes together
  static constexpr int kVectors = kVectorsOfRow / kLanes;
  float values[kVectors * kWidth];

  template <typename T>
  struct alignas(16) Vector {
    T values[kWidth];
  };

  template <typename T>
  __device__ void load(const T* row) {
#pragma unroll
    for (int v = 0; v < kVectors; ++v) {
      const Vector<T> vector = reinterpret_cast<const Vector<T>*>(row)[threadIdx.x % kLanes + kLanes * v];
#pragma unroll
      for (int k = 0; k < kWidth; ++k) values[v * kWidth + k] = to_float(vector.values[k]);
    }
  }
  template <typename T>
  __device__ void store(T* row) const {
#pragma unroll
    for (int v = 0; v < kVectors; ++v) {
      Vector<T> vector;
#pragma unroll
      for (int k = 0; k < kWidth; ++k) vector.values[k] = from_float<T>(values[v * kWidth + k]);
      reinterpret_cast<Vector<T>*>(row)[threadIdx.x % kLanes + kLanes * v] = vector;
    }
  }
  __device__ float mean() const {
    float sum = 0;
#pragma unroll
    for (int k = 0; k < kVectors * kWidth; ++k) sum += values[k];
#pragma unroll
    for (int distance = kLanes / 2; distance > 0; distance /= 2) sum += __shfl_xor_sync(0xffffffffu, sum, distance);
    return sum / kChannels;
  }
  /// Replaces each value by f(index, value).
  template <typename F>
  __device__ void each(F&& f) {
#pragma unroll
    for (int k = 0; k < kVectors * kWidth; ++k) values[k] = f(k, values[k]);
  }
  /// Stores the sum of the warp's rows.
  __device__ void store_sum(float* row) {
#pragma unroll
    for (int distance = kLanes; distance < kWarp; distance *= 2) {
      each([&](int, float v) { return v + __shfl_xor_sync(0xffffffffu, v, distance); });
    }
    if (threadIdx.x % kWarp < kLanes) store(row);
  }
};

/// Normalizes the row to mean 0 and variance 1; returns 1 / its standard deviation.
template <int kChannels>
__device__ float normalize(RowPart<kChannels>* row_inout) {
  RowPart<kChannels>& row = *row_inout;
  const float mean = row.mean();
  row.each([&](int, float v) { return v - mean; });
  RowPart<kChannels> squares = row;
  squares.each([](int, float v) { return v * v; });
  const float inverse_deviation = rsqrtf(squares.mean() + kNormEpsilon);
  row.each([&](int, float v) { return v * inverse_deviation; });
  return inverse_deviation;
}

/// Computes the gradient of a row from the gradient of its normalize() result.
template <int kChannels>
__device__ void normalize_backward(const RowPart<kChannels>& normalized, float inverse_deviation,
                                   RowPart<kChannels>* grad_inout) {
  RowPart<kChannels>& grad = *grad_inout;
  RowPart<kChannels> products = grad;
  products.each([&](int k, float g) { return g * normalized.values[k]; });
  const float mean = grad.mean(), product_mean = products.mean();
  grad.each([&](int k, float g) { return (g - mean - normalized.values[k] * product_mean) * inverse_deviation; });
}

/// Loads x + bias and normalizes it; returns 1 / its standard deviation.
template <typename T, int kChannels>
__device__ float load_biased_normalized(const T* x, const RowPart<kChannels>& bias, RowPart<kChannels>* row_out) {
  row_out->load(x);
  row_out->each([&](int k, float v) { return v + bias.values[k]; });
  return normalize(row_out);
}

/// Loads x + position and normalizes it; returns 1 / its standard deviation.
template <typename T, int kChannels>
__device__ float load_normalized(const T* x, const T* position, RowPart<kChannels>* row_out) {
  RowPart<kChannels>& row = *row_out;
  row.load(x);
  if (position) {
    RowPart<kChannels> added;
    added.load(position);
    // Rounded like the sum that ATen stores.
    row.each([&](int k, float v) { return to_float(from_float<T>(v + added.values[k])); });
  }
  return normalize(row_out);
}

/// Calls f(row, whether it exists) for the row of a thread. All lanes of a warp take part, because they exchange
/// values: those after the last row process it again.
template <int kChannels, typename F>
__device__ void for_row(int64_t rows, F&& f) {
  const int64_t row = (blockIdx.x * int64_t{kThreads} + threadIdx.x) / RowPart<kChannels>::kLanes;
  f(row < rows ? row : rows - 1, row < rows);
}

/// Calls f(row, whether it exists) for each row of a warp, which adds the rows of one position. Warps have indices
/// (sum, position). A row that does not exist is replaced by another of the position.
template <int kChannels, typename F>
__device__ void for_rows_of_sum(int64_t warp, int64_t rows, int64_t period, int64_t num_sums, F&& f) {
  constexpr int kRows = RowPart<kChannels>::kRows;
  const int64_t position = warp % period, sum = warp / period;
  const int64_t after_first = threadIdx.x % kWarp / RowPart<kChannels>::kLanes * period;
  for (int64_t first = position + sum * kRows * period; first < rows; first += num_sums * kRows * period) {
    const bool exists = first + after_first < rows;
    f(exists ? first + after_first : first, exists);
  }
}

__device__ inline int64_t warp_index() { return (blockIdx.x * int64_t{kThreads} + threadIdx.x) / kWarp; }

template <typename T, int kChannels>
__global__ void __launch_bounds__(kThreads) bias_norm_gelu(int64_t rows, const T* x, const float* bias, T* out) {
  RowPart<kChannels> biases, values;
  biases.load(bias);
  for_row<kChannels>(rows, [&](int64_t row, bool exists) {
    load_biased_normalized(x + row * kChannels, biases, &values);
    values.each([](int, float v) { return gelu(v); });
    if (exists) values.store(out + row * kChannels);
  });
}

template <typename T, int kChannels>
__global__ void __launch_bounds__(kThreads)
    bias_norm_gelu_backward(int64_t rows, int64_t num_sums, const T* x, const float* bias, const T* grad_out,
                            T* grad_x_out, float* sums_out) {
  if (warp_index() >= num_sums) return;
  RowPart<kChannels> biases, sums{};
  biases.load(bias);
  for_rows_of_sum<kChannels>(warp_index(), rows, /*period=*/1, num_sums, [&](int64_t row, bool exists) {
    RowPart<kChannels> normalized, grad;
    const float inverse_deviation = load_biased_normalized(x + row * kChannels, biases, &normalized);
    grad.load(grad_out + row * kChannels);
    grad.each([&](int k, float g) { return g * gelu_derivative(normalized.values[k]); });
    normalize_backward(normalized, inverse_deviation, &grad);
    if (!exists) return;
    sums.each([&](int k, float sum) { return sum + grad.values[k]; });
    grad.store(grad_x_out + row * kChannels);
  });
  sums.store_sum(sums_out + warp_index() * kChannels);
}

template <typename T, int kChannels>
__global__ void __launch_bounds__(kThreads)
    norm(int64_t rows, const T* x, const T* position, int64_t period, const float* weight, const float* bias, T* out) {
  for_row<kChannels>(rows, [&](int64_t row, bool exists) {
    RowPart<kChannels> values, weights, biases;
    load_normalized(x + row * kChannels, position ? position + row % period * kChannels : nullptr, &values);
    weights.load(weight);
    biases.load(bias);
    values.each([&](int k, float v) { return v * weights.values[k] + biases.values[k]; });
    if (exists) values.store(out + row * kChannels);
  });
}

template <typename T, int kChannels>
__global__ void __launch_bounds__(kThreads)
    norm_backward(int64_t rows, const T* x, const T* position, int64_t period, int64_t num_sums, const float* weight,
                  const T* grad_out, T* grad_x_out, float* sums_out) {
  const int64_t warp = warp_index();
  if (warp >= period * num_sums) return;
  RowPart<kChannels> weights, position_sums{}, weight_sums{}, bias_sums{};
  weights.load(weight);
  for_rows_of_sum<kChannels>(warp, rows, period, num_sums, [&](int64_t row, bool exists) {
    RowPart<kChannels> normalized, grad;
    const float inverse_deviation =
        load_normalized(x + row * kChannels, position ? position + row % period * kChannels : nullptr, &normalized);
    grad.load(grad_out + row * kChannels);
    if (exists) {
      weight_sums.each([&](int k, float sum) { return sum + grad.values[k] * normalized.values[k]; });
      bias_sums.each([&](int k, float sum) { return sum + grad.values[k]; });
    }
    grad.each([&](int k, float g) { return g * weights.values[k]; });
    normalize_backward(normalized, inverse_deviation, &grad);
    if (!exists) return;
    position_sums.each([&](int k, float sum) { return sum + grad.values[k]; });
    grad.store(grad_x_out + row * kChannels);
  });
  float* const sums = sums_out + warp * 3 * kChannels;
  position_sums.store_sum(sums);
  weight_sums.store_sum(sums + kChannels);
  bias_sums.store_sum(sums + 2 * kChannels);
}

}  // namespace pictura::cuda::row_norms
