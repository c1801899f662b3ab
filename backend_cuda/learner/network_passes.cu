// Passes of a network over its activations on a CUDA device. Kernels load and store vectors of 16 bytes, and add in
// fp32 in a fixed order.
#include <type_traits>

#include <cuda_bf16.h>

#include "pictura/backend_cuda/learner/activation.cuh"
#include "pictura/backend_cuda/learner/network_kernels.h"

namespace pictura::cuda {

namespace {

constexpr int kThreads = 256;

__device__ float to_float(float x) { return x; }
__device__ float to_float(__nv_bfloat16 x) { return __bfloat162float(x); }
template <typename T>
__device__ T from_float(float x) {
  if constexpr (std::is_same_v<T, float>)
    return x;
  else
    return __float2bfloat16(x);
}

/// kSize neighbouring elements, loaded and stored together.
template <typename T, int kSize>
struct alignas(sizeof(T) * kSize) Vector {
  T values[kSize];
};

template <typename T>
__global__ void __launch_bounds__(kThreads)
    bias_gelu(int64_t num_vectors, int vectors_a_row, const T* x, const float* bias, T* out) {
  constexpr int kWidth = 16 / sizeof(T);
  using Vector = Vector<T, kWidth>;
  const int64_t i = blockIdx.x * int64_t{kThreads} + threadIdx.x;
  if (i >= num_vectors) return;
  const float* const its_bias = bias + i % vectors_a_row * kWidth;
  Vector v = reinterpret_cast<const Vector*>(x)[i];
#pragma unroll
  for (int k = 0; k < kWidth; ++k) v.values[k] = from_float<T>(gelu(to_float(v.values[k]) + its_bias[k]));
  reinterpret_cast<Vector*>(out)[i] = v;
}

// A thread processes the channels of one vector, in rows at a fixed stride. The sums of a block's threads are added in
// shared memory.
template <typename T>
__global__ void __launch_bounds__(kThreads)
    bias_gelu_backward(int64_t rows, int channels, const T* x, const float* bias, const T* grad_out, T* grad_x_out,
                       float* sums_out) {
  constexpr int kWidth = 16 / sizeof(T);
  using Vector = Vector<T, kWidth>;
  __shared__ float shared[kThreads][kWidth];
  const int vectors_a_row = channels / kWidth, rows_a_block = kThreads / vectors_a_row;
  const int column = static_cast<int>(threadIdx.x) % vectors_a_row;
  const int row_in_block = static_cast<int>(threadIdx.x) / vectors_a_row;
  float its_bias[kWidth], sums[kWidth];
#pragma unroll
  for (int k = 0; k < kWidth; ++k) {
    its_bias[k] = bias[column * kWidth + k];
    sums[k] = 0;
  }
  if (row_in_block < rows_a_block) {
    for (int64_t row = blockIdx.x * int64_t{rows_a_block} + row_in_block; row < rows;
         row += gridDim.x * int64_t{rows_a_block}) {
      const int64_t i = row * vectors_a_row + column;
      const Vector before = reinterpret_cast<const Vector*>(x)[i];
      Vector grad = reinterpret_cast<const Vector*>(grad_out)[i];
#pragma unroll
      for (int k = 0; k < kWidth; ++k) {
        const float g = to_float(grad.values[k]) * gelu_derivative(to_float(before.values[k]) + its_bias[k]);
        grad.values[k] = from_float<T>(g);
        sums[k] += g;
      }
      reinterpret_cast<Vector*>(grad_x_out)[i] = grad;
    }
  }
#pragma unroll
  for (int k = 0; k < kWidth; ++k) shared[threadIdx.x][k] = sums[k];
  __syncthreads();
  for (int c = static_cast<int>(threadIdx.x); c < channels; c += kThreads) {
    float sum = 0;
    for (int r = 0; r < rows_a_block; ++r) sum += shared[r * vectors_a_row + c / kWidth][c % kWidth];
    sums_out[blockIdx.x * int64_t{channels} + c] = sum;
  }
}

__device__ float warp_sum(float x) {
#pragma unroll
  for (int distance = kWarp / 2; distance > 0; distance /= 2) x += __shfl_xor_sync(0xffffffffu, x, distance);
  return x;
}

/// A row in the registers of a warp: lane l has channels 2 (l + 32 k) and the next, for k < kPairs.
template <int kPairs>
struct WarpRow {
  static constexpr int kChannels = 2 * kWarp * kPairs;
  float values[2 * kPairs];

  template <typename T>
  __device__ void load(const T* row) {
#pragma unroll
    for (int k = 0; k < kPairs; ++k) {
      const auto pair = reinterpret_cast<const Vector<T, 2>*>(row)[threadIdx.x % kWarp + kWarp * k];
      values[2 * k] = to_float(pair.values[0]);
      values[2 * k + 1] = to_float(pair.values[1]);
    }
  }
  template <typename T>
  __device__ void store(T* row) const {
#pragma unroll
    for (int k = 0; k < kPairs; ++k) {
      reinterpret_cast<Vector<T, 2>*>(row)[threadIdx.x % kWarp + kWarp * k] = {from_float<T>(values[2 * k]),
                                                                               from_float<T>(values[2 * k + 1])};
    }
  }
  __device__ float mean() const {
    float sum = 0;
#pragma unroll
    for (int k = 0; k < 2 * kPairs; ++k) sum += values[k];
    return warp_sum(sum) / kChannels;
  }
  template <typename F>
  __device__ void each(F&& f) {
#pragma unroll
    for (int k = 0; k < 2 * kPairs; ++k) values[k] = f(k, values[k]);
  }
};

/// Normalizes the row to mean 0 and variance 1; returns 1 / its standard deviation.
template <int kPairs>
__device__ float normalize(WarpRow<kPairs>* row_inout) {
  WarpRow<kPairs>& row = *row_inout;
  const float mean = row.mean();
  row.each([&](int, float v) { return v - mean; });
  WarpRow<kPairs> squares = row;
  squares.each([](int, float v) { return v * v; });
  const float inverse_deviation = rsqrtf(squares.mean() + kNormEpsilon);
  row.each([&](int, float v) { return v * inverse_deviation; });
  return inverse_deviation;
}

/// Computes the gradient of a row from the gradient of its normalize() result.
template <int kPairs>
__device__ void normalize_backward(const WarpRow<kPairs>& normalized, float inverse_deviation,
                                   WarpRow<kPairs>* grad_inout) {
  WarpRow<kPairs>& grad = *grad_inout;
  WarpRow<kPairs> products = grad;
  products.each([&](int k, float g) { return g * normalized.values[k]; });
  const float mean = grad.mean(), product_mean = products.mean();
  grad.each([&](int k, float g) { return (g - mean - normalized.values[k] * product_mean) * inverse_deviation; });
}

/// Loads x + bias and normalizes it; returns 1 / its standard deviation.
template <typename T, int kPairs>
__device__ float load_biased_normalized(const T* x, const WarpRow<kPairs>& bias, WarpRow<kPairs>* row_out) {
  row_out->load(x);
  row_out->each([&](int k, float v) { return v + bias.values[k]; });
  return normalize(row_out);
}

template <typename T, int kPairs>
__global__ void __launch_bounds__(kThreads) bias_norm_gelu(int64_t rows, const T* x, const float* bias, T* out) {
  const int64_t row = (blockIdx.x * int64_t{kThreads} + threadIdx.x) / kWarp;
  if (row >= rows) return;
  constexpr int kChannels = WarpRow<kPairs>::kChannels;
  WarpRow<kPairs> biases, values;
  biases.load(bias);
  load_biased_normalized(x + row * kChannels, biases, &values);
  values.each([](int, float v) { return gelu(v); });
  values.store(out + row * kChannels);
}

// A warp processes every num_sums-th row.
template <typename T, int kPairs>
__global__ void __launch_bounds__(kThreads)
    bias_norm_gelu_backward(int64_t rows, int64_t num_sums, const T* x, const float* bias, const T* grad_out,
                            T* grad_x_out, float* sums_out) {
  const int64_t warp = (blockIdx.x * int64_t{kThreads} + threadIdx.x) / kWarp;
  if (warp >= num_sums) return;
  constexpr int kChannels = WarpRow<kPairs>::kChannels;
  WarpRow<kPairs> biases, sums{};
  biases.load(bias);
  for (int64_t row = warp; row < rows; row += num_sums) {
    WarpRow<kPairs> normalized, grad;
    const float inverse_deviation = load_biased_normalized(x + row * kChannels, biases, &normalized);
    grad.load(grad_out + row * kChannels);
    grad.each([&](int k, float g) { return g * gelu_derivative(normalized.values[k]); });
    normalize_backward(normalized, inverse_deviation, &grad);
    sums.each([&](int k, float sum) { return sum + grad.values[k]; });
    grad.store(grad_x_out + row * kChannels);
  }
  sums.store(sums_out + warp * kChannels);
}

/// Loads x + position and normalizes it; returns 1 / its standard deviation.
template <typename T, int kPairs>
__device__ float load_normalized(const T* x, const T* position, WarpRow<kPairs>* row_out) {
  WarpRow<kPairs>& row = *row_out;
  row.load(x);
  if (position) {
    WarpRow<kPairs> added;
    added.load(position);
    // Rounded like the sum that ATen stores.
    row.each([&](int k, float v) { return to_float(from_float<T>(v + added.values[k])); });
  }
  return normalize(row_out);
}

template <typename T, int kPairs>
__global__ void __launch_bounds__(kThreads)
    norm(int64_t rows, const T* x, const T* position, int64_t period, const float* weight, const float* bias, T* out) {
  const int64_t row = (blockIdx.x * int64_t{kThreads} + threadIdx.x) / kWarp;
  if (row >= rows) return;
  constexpr int kChannels = WarpRow<kPairs>::kChannels;
  WarpRow<kPairs> values, weights, biases;
  load_normalized(x + row * kChannels, position ? position + row % period * kChannels : nullptr, &values);
  weights.load(weight);
  biases.load(bias);
  values.each([&](int k, float v) { return v * weights.values[k] + biases.values[k]; });
  values.store(out + row * kChannels);
}

// A warp processes the rows of one position, at a fixed stride of repetitions of the period.
template <typename T, int kPairs>
__global__ void __launch_bounds__(kThreads)
    norm_backward(int64_t rows, const T* x, const T* position, int64_t period, int64_t num_sums, const float* weight,
                  const T* grad_out, T* grad_x_out, float* sums_out) {
  const int64_t warp = (blockIdx.x * int64_t{kThreads} + threadIdx.x) / kWarp;
  if (warp >= period * num_sums) return;
  constexpr int kChannels = WarpRow<kPairs>::kChannels;
  WarpRow<kPairs> weights;
  weights.load(weight);
  WarpRow<kPairs> position_sums{}, weight_sums{}, bias_sums{};
  for (int64_t row = warp; row < rows; row += period * num_sums) {
    WarpRow<kPairs> normalized, grad;
    const float inverse_deviation =
        load_normalized(x + row * kChannels, position ? position + row % period * kChannels : nullptr, &normalized);
    grad.load(grad_out + row * kChannels);
    weight_sums.each([&](int k, float sum) { return sum + grad.values[k] * normalized.values[k]; });
    bias_sums.each([&](int k, float sum) { return sum + grad.values[k]; });
    grad.each([&](int k, float g) { return g * weights.values[k]; });
    normalize_backward(normalized, inverse_deviation, &grad);
    position_sums.each([&](int k, float sum) { return sum + grad.values[k]; });
    grad.store(grad_x_out + row * kChannels);
  }
  // Warp index = (sum, position), because the stride is a multiple of the period.
  float* const sums = sums_out + warp * 3 * kChannels;
  position_sums.store(sums);
  weight_sums.store(sums + kChannels);
  bias_sums.store(sums + 2 * kChannels);
}

// A thread writes one number. A block has whole rows, which avoids 64-bit division.
template <typename T>
__global__ void __launch_bounds__(kThreads)
    row_features(RowSize size, int width, int rows_a_block, const float* rows, T* out) {
  const int i = static_cast<int>(threadIdx.x), kept = static_cast<int>(size.kept());
  const int64_t row = blockIdx.x * int64_t{rows_a_block} + i / width;
  if (i >= rows_a_block * width || row >= size.rows) return;
  const float* const its_row = rows + row * size.columns;
  const int column = i % width;
  const float value = column < kept ? its_row[column] : row_feature(size.features, its_row, column - kept);
  out[row * width + column] = from_float<T>(value);
}

// Loads the row of a patch. `count` of its pixels lie in the image, and the others are black. If `is_aligned`, rows
// begin at multiples of their size. One load then reads the largest power of two of pixels that divides kPatch.
template <int kPatch>
__device__ void load_patch_row(const uint8_t* from, int count, bool is_aligned, uint8_t (&pixels_out)[kPatch]) {
  struct alignas(kPatch & -kPatch) Row {
    uint8_t pixels[kPatch];
  };
  Row row{};
  if (is_aligned && count == kPatch) {
    row = *reinterpret_cast<const Row*>(from);
  } else {
#pragma unroll
    for (int x = 0; x < kPatch; ++x) row.pixels[x] = x < count ? from[x] : 0;
  }
#pragma unroll
  for (int x = 0; x < kPatch; ++x) pixels_out[x] = row.pixels[x];
}

// A thread writes all channels of a position. Its indices fit into 32 bits, except for the offset of the image.
template <typename T, int kPatch>
__global__ void __launch_bounds__(kThreads) patches(PatchSize size, int num_positions, const uint8_t* images, T* out) {
  constexpr int kWidth = 16 / sizeof(T), kChannels = static_cast<int>(PatchSize::channels_of(kPatch));
  const int image_index = static_cast<int>(blockIdx.x);
  const int position = static_cast<int>(blockIdx.y) * kThreads + static_cast<int>(threadIdx.x);
  if (position >= num_positions) return;
  const auto columns = static_cast<int>(size.columns()), height = static_cast<int>(size.height_px),
             width = static_cast<int>(size.width_px), views = static_cast<int>(size.views);
  const int camera = image_index / views, view = image_index % views;
  const uint8_t* const image = images + (view * size.cameras + camera) * 3 * static_cast<int64_t>(height) * width;
  const int first_y = position / columns * kPatch, first_x = position % columns * kPatch;
  const bool is_aligned = width % kPatch == 0;

  alignas(16) T values[kChannels] = {};
#pragma unroll
  for (int row = 0; row < 3 * kPatch; ++row) {
    const int color = row / kPatch, y = first_y + row % kPatch;
    uint8_t pixels[kPatch];
    load_patch_row<kPatch>(image + (color * height + y) * width + first_x,
                           y < height ? min(kPatch, width - first_x) : 0, is_aligned, pixels);
#pragma unroll
    for (int x = 0; x < kPatch; ++x) values[row * kPatch + x] = from_float<T>(static_cast<float>(pixels[x]));
  }
  using Part = Vector<T, kWidth>;
  Part* const its_out =
      reinterpret_cast<Part*>(out + (image_index * int64_t{num_positions} + position) * int64_t{kChannels});
#pragma unroll
  for (int i = 0; i < kChannels / kWidth; ++i) its_out[i] = reinterpret_cast<const Part*>(values)[i];
}

// A thread processes a pair of columns of a matrix [tokens, columns]; neighbouring threads read neighbouring memory.
// The second read comes from the cache.
template <typename T>
__global__ void __launch_bounds__(kThreads)
    token_softmax(int64_t num_pairs, int tokens, int columns, const T* scores, T* out) {
  using Pair = Vector<T, 2>;
  const int64_t i = blockIdx.x * int64_t{kThreads} + threadIdx.x;
  if (i >= num_pairs) return;
  const int pairs_a_row = columns / 2;
  const int64_t first = i / pairs_a_row * tokens * pairs_a_row + i % pairs_a_row;
  const Pair* const its_scores = reinterpret_cast<const Pair*>(scores) + first;
  Pair* const its_out = reinterpret_cast<Pair*>(out) + first;
  // Maximum so far, and the sum of the exponentials of values relative to it.
  float largest[2] = {-INFINITY, -INFINITY}, sums[2] = {0, 0};
  for (int t = 0; t < tokens; ++t) {
    const Pair pair = its_scores[t * pairs_a_row];
#pragma unroll
    for (int k = 0; k < 2; ++k) {
      const float score = to_float(pair.values[k]), larger = fmaxf(largest[k], score);
      sums[k] = sums[k] * __expf(largest[k] - larger) + __expf(score - larger);
      largest[k] = larger;
    }
  }
  const float factors[2] = {1 / sums[0], 1 / sums[1]};
  for (int t = 0; t < tokens; ++t) {
    Pair pair = its_scores[t * pairs_a_row];
#pragma unroll
    for (int k = 0; k < 2; ++k)
      pair.values[k] = from_float<T>(__expf(to_float(pair.values[k]) - largest[k]) * factors[k]);
    its_out[t * pairs_a_row] = pair;
  }
}

// Computes grad_scores = out * (grad_out - sum over tokens of out * grad_out).
template <typename T>
__global__ void __launch_bounds__(kThreads)
    token_softmax_backward(int64_t num_pairs, int tokens, int columns, const T* out, const T* grad_out,
                           T* grad_scores_out) {
  using Pair = Vector<T, 2>;
  const int64_t i = blockIdx.x * int64_t{kThreads} + threadIdx.x;
  if (i >= num_pairs) return;
  const int pairs_a_row = columns / 2;
  const int64_t first = i / pairs_a_row * tokens * pairs_a_row + i % pairs_a_row;
  const Pair *const its_out = reinterpret_cast<const Pair*>(out) + first, *const its_grad =
                                                                              reinterpret_cast<const Pair*>(grad_out) +
                                                                              first;
  Pair* const its_result = reinterpret_cast<Pair*>(grad_scores_out) + first;
  float sums[2] = {0, 0};
  for (int t = 0; t < tokens; ++t) {
    const Pair p = its_out[t * pairs_a_row], g = its_grad[t * pairs_a_row];
#pragma unroll
    for (int k = 0; k < 2; ++k) sums[k] += to_float(p.values[k]) * to_float(g.values[k]);
  }
  for (int t = 0; t < tokens; ++t) {
    const Pair p = its_out[t * pairs_a_row];
    Pair g = its_grad[t * pairs_a_row];
#pragma unroll
    for (int k = 0; k < 2; ++k) g.values[k] = from_float<T>(to_float(p.values[k]) * (to_float(g.values[k]) - sums[k]));
    its_result[t * pairs_a_row] = g;
  }
}

template <typename Kernel, typename... Arguments>
void launch(int64_t num_threads, cudaStream_t stream, Kernel kernel, const Arguments&... arguments) {
  if (num_threads == 0) return;
  kernel<<<static_cast<unsigned>((num_threads + kThreads - 1) / kThreads), kThreads, 0, stream>>>(arguments...);
}

/// Calls f(T{}) with the C++ type of an element type.
template <typename F>
void with_type(ActivationType type, F&& f) {
  if (type == ActivationType::f32)
    f(float{});
  else
    f(__nv_bfloat16{});
}

/// Calls f with an integral constant n for rows of 64 n channels.
template <typename F>
void with_pairs(int64_t channels, F&& f) {
  switch (channels) {
    case 64: return f(std::integral_constant<int, 1>{});
    case 128: return f(std::integral_constant<int, 2>{});
    case 192: return f(std::integral_constant<int, 3>{});
    case 256: return f(std::integral_constant<int, 4>{});
    case 384: return f(std::integral_constant<int, 6>{});
    case 512: return f(std::integral_constant<int, 8>{});
    default: return;
  }
}

/// Calls f with an integral constant, the side of a patch; does nothing for sides that PatchSize::supports() refuses.
template <typename F>
void with_patch(int64_t patch_px, F&& f) {
  switch (patch_px) {
    case 1: return f(std::integral_constant<int, 1>{});
    case 2: return f(std::integral_constant<int, 2>{});
    case 3: return f(std::integral_constant<int, 3>{});
    case 4: return f(std::integral_constant<int, 4>{});
    case 6: return f(std::integral_constant<int, 6>{});
    default: return;
  }
}

}  // namespace

void launch_bias_gelu(const ActivationSize& size, const void* x, const float* bias, void* out, cudaStream_t stream) {
  with_type(size.type, [&](auto type) {
    using T = decltype(type);
    const int64_t vectors_a_row = size.channels * static_cast<int64_t>(sizeof(T)) / 16;
    const int64_t num_vectors = size.rows * vectors_a_row;
    launch(num_vectors, stream, bias_gelu<T>, num_vectors, static_cast<int>(vectors_a_row), static_cast<const T*>(x),
           bias, static_cast<T*>(out));
  });
}

void launch_bias_gelu_backward(const ActivationSize& size, const void* x, const float* bias, const void* grad_out,
                               void* grad_x_out, float* grad_bias_sums_out, cudaStream_t stream) {
  with_type(size.type, [&](auto type) {
    using T = decltype(type);
    launch(NetworkPasses::kBiasSums * kThreads, stream, bias_gelu_backward<T>, size.rows,
           static_cast<int>(size.channels), static_cast<const T*>(x), bias, static_cast<const T*>(grad_out),
           static_cast<T*>(grad_x_out), grad_bias_sums_out);
  });
}

void launch_bias_norm_gelu(const ActivationSize& size, const void* x, const float* bias, void* out,
                           cudaStream_t stream) {
  with_type(size.type, [&](auto type) {
    with_pairs(size.channels, [&](auto pairs) {
      using T = decltype(type);
      launch(size.rows * kWarp, stream, bias_norm_gelu<T, decltype(pairs)::value>, size.rows, static_cast<const T*>(x),
             bias, static_cast<T*>(out));
    });
  });
}

void launch_bias_norm_gelu_backward(const ActivationSize& size, const void* x, const float* bias, const void* grad_out,
                                    void* grad_x_out, float* grad_bias_sums_out, cudaStream_t stream) {
  const int64_t num_sums = NetworkPasses::num_norm_sums(size.rows, 1);
  with_type(size.type, [&](auto type) {
    with_pairs(size.channels, [&](auto pairs) {
      using T = decltype(type);
      launch(num_sums * kWarp, stream, bias_norm_gelu_backward<T, decltype(pairs)::value>, size.rows, num_sums,
             static_cast<const T*>(x), bias, static_cast<const T*>(grad_out), static_cast<T*>(grad_x_out),
             grad_bias_sums_out);
    });
  });
}

void launch_norm(const ActivationSize& size, const void* x, const void* position, int64_t period, const float* weight,
                 const float* bias, void* out, cudaStream_t stream) {
  with_type(size.type, [&](auto type) {
    with_pairs(size.channels, [&](auto pairs) {
      using T = decltype(type);
      launch(size.rows * kWarp, stream, norm<T, decltype(pairs)::value>, size.rows, static_cast<const T*>(x),
             static_cast<const T*>(position), period, weight, bias, static_cast<T*>(out));
    });
  });
}

void launch_norm_backward(const ActivationSize& size, const void* x, const void* position, int64_t period,
                          const float* weight, const void* grad_out, void* grad_x_out, float* sums_out,
                          cudaStream_t stream) {
  const int64_t num_sums = NetworkPasses::num_norm_sums(size.rows, period);
  with_type(size.type, [&](auto type) {
    with_pairs(size.channels, [&](auto pairs) {
      using T = decltype(type);
      launch(num_sums * period * kWarp, stream, norm_backward<T, decltype(pairs)::value>, size.rows,
             static_cast<const T*>(x), static_cast<const T*>(position), period, num_sums, weight,
             static_cast<const T*>(grad_out), static_cast<T*>(grad_x_out), sums_out);
    });
  });
}

void launch_row_features(const RowSize& size, const float* rows, ActivationType type, void* out, cudaStream_t stream) {
  if (size.rows == 0) return;
  const int width = static_cast<int>(size.width()), rows_a_block = kThreads / width;
  const auto blocks = static_cast<unsigned>((size.rows + rows_a_block - 1) / rows_a_block);
  with_type(type, [&](auto element) {
    using T = decltype(element);
    row_features<T><<<blocks, kThreads, 0, stream>>>(size, width, rows_a_block, rows, static_cast<T*>(out));
  });
}

void launch_patches(const PatchSize& size, const uint8_t* images, ActivationType type, void* out, cudaStream_t stream) {
  const int64_t num_images = size.views * size.cameras, num_positions = size.rows() * size.columns();
  if (num_images == 0) return;
  // Images are along the grid axis with the larger limit.
  const dim3 blocks(static_cast<unsigned>(num_images),
                    static_cast<unsigned>((num_positions + kThreads - 1) / kThreads));
  with_type(type, [&](auto element) {
    with_patch(size.patch_px, [&](auto patch) {
      using T = decltype(element);
      patches<T, decltype(patch)::value>
          <<<blocks, kThreads, 0, stream>>>(size, static_cast<int>(num_positions), images, static_cast<T*>(out));
    });
  });
}

void launch_token_softmax(const TokenSize& size, const void* scores, void* out, cudaStream_t stream) {
  with_type(size.type, [&](auto type) {
    using T = decltype(type);
    const int64_t num_pairs = size.matrices * size.columns / 2;
    launch(num_pairs, stream, token_softmax<T>, num_pairs, static_cast<int>(size.tokens),
           static_cast<int>(size.columns), static_cast<const T*>(scores), static_cast<T*>(out));
  });
}

void launch_token_softmax_backward(const TokenSize& size, const void* out, const void* grad_out, void* grad_scores_out,
                                   cudaStream_t stream) {
  with_type(size.type, [&](auto type) {
    using T = decltype(type);
    const int64_t num_pairs = size.matrices * size.columns / 2;
    launch(num_pairs, stream, token_softmax_backward<T>, num_pairs, static_cast<int>(size.tokens),
           static_cast<int>(size.columns), static_cast<const T*>(out), static_cast<const T*>(grad_out),
           static_cast<T*>(grad_scores_out));
  });
}

}  // namespace pictura::cuda
