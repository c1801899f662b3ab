// Passes of a network over its activations on a CUDA device. Kernels load and store vectors of 16 bytes, and add in
// fp32 in a fixed order.
#include "pictura/backend_cuda/learner/network_kernels.h"
#include "pictura/backend_cuda/learner/tensor_core.cuh"
// Include these after the functions of tensor cores.
#include "pictura/backend_cuda/learner/image_patches.cuh"
#include "pictura/backend_cuda/learner/row_norms.cuh"

namespace pictura::cuda {

namespace {

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
    f(Half{});
}

/// Calls f with an integral constant, the number of channels.
template <typename F>
void with_norm_channels(int64_t channels, F&& f) {
  switch (channels) {
    case 64: return f(std::integral_constant<int, 64>{});
    case 128: return f(std::integral_constant<int, 128>{});
    case 192: return f(std::integral_constant<int, 192>{});
    case 256: return f(std::integral_constant<int, 256>{});
    case 384: return f(std::integral_constant<int, 384>{});
    case 512: return f(std::integral_constant<int, 512>{});
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
    with_norm_channels(size.channels, [&](auto channels) {
      using T = decltype(type);
      launch(size.rows * row_norms::RowPart<decltype(channels)::value>::kLanes, stream,
             row_norms::bias_norm_gelu<T, decltype(channels)::value>, size.rows, static_cast<const T*>(x), bias,
             static_cast<T*>(out));
    });
  });
}

void launch_bias_norm_gelu_backward(const ActivationSize& size, const void* x, const float* bias, const void* grad_out,
                                    void* grad_x_out, float* grad_bias_sums_out, cudaStream_t stream) {
  const int64_t num_sums = NetworkPasses::num_norm_sums(size.rows, 1);
  with_type(size.type, [&](auto type) {
    with_norm_channels(size.channels, [&](auto channels) {
      using T = decltype(type);
      launch(num_sums * kWarp, stream, row_norms::bias_norm_gelu_backward<T, decltype(channels)::value>, size.rows,
             num_sums, static_cast<const T*>(x), bias, static_cast<const T*>(grad_out), static_cast<T*>(grad_x_out),
             grad_bias_sums_out);
    });
  });
}

void launch_norm(const ActivationSize& size, const void* x, const void* position, int64_t period, const float* weight,
                 const float* bias, void* out, cudaStream_t stream) {
  with_type(size.type, [&](auto type) {
    with_norm_channels(size.channels, [&](auto channels) {
      using T = decltype(type);
      launch(size.rows * row_norms::RowPart<decltype(channels)::value>::kLanes, stream,
             row_norms::norm<T, decltype(channels)::value>, size.rows, static_cast<const T*>(x),
             static_cast<const T*>(position), period, weight, bias, static_cast<T*>(out));
    });
  });
}

void launch_norm_backward(const ActivationSize& size, const void* x, const void* position, int64_t period,
                          const float* weight, const void* grad_out, void* grad_x_out, float* sums_out,
                          cudaStream_t stream) {
  const int64_t num_sums = NetworkPasses::num_norm_sums(size.rows, period);
  with_type(size.type, [&](auto type) {
    with_norm_channels(size.channels, [&](auto channels) {
      using T = decltype(type);
      launch(num_sums * period * kWarp, stream, row_norms::norm_backward<T, decltype(channels)::value>, size.rows,
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
  const int64_t num_images = size.views * size.cameras, tiles = (size.columns() - 1) / image_patches::kTile + 1;
  if (num_images == 0) return;
  // Images are along the grid axis with the largest limit.
  const dim3 blocks(static_cast<unsigned>(num_images), static_cast<unsigned>(size.rows()),
                    static_cast<unsigned>(tiles));
  with_type(type, [&](auto element) {
    with_patch(size.patch_px, [&](auto patch) {
      using T = decltype(element);
      constexpr int kPatch = decltype(patch)::value;
      image_patches::patches<T, kPatch>
          <<<blocks, kThreads, sizeof(image_patches::Tile<kPatch>), stream>>>(size, images, static_cast<T*>(out));
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
